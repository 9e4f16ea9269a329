"""Rows recorder_write, recorder_loss, report: bags written, torn off and read."""

from __future__ import annotations

import io
import signal
import statistics
import sys
import time
from collections.abc import Callable
from pathlib import Path

from cell_recorder.reading.bag_reader_io import open_bag
from cell_recorder.recording.bag_writer_io import BagWriter
from cell_recorder.recording.recording import RecorderSettings
from scara_config import config_directory, load_robot
from scara_config.loader import load_keys
from twin_experiments.report.report_io import analyse_bag

from bench.cells.long_bag import DURATION_S, long_bag
from bench.peers.process import Peer
from bench.record import Beside, Goal, Record, interleaved, median, of_rounds
from bench.room import Room

WRITES, WRITE_ROUNDS = 20_000, 7
TOPICS = {
    "twin/joint_states": 200.0,
    "real/ground_truth": 250.0,
    "real/joint_states": 100.0,
    "twin/joint_setpoints": 100.0,
}
"""Topics and messages per second that are recorded until the kill."""
RECORDED_S = 30.0


def settings_of_the_recorder() -> RecorderSettings:
    """Return the recorder's own settings."""
    file = config_directory() / "experiments.yaml"
    (settings,) = load_keys(file, {"recorder": RecorderSettings})
    return settings


def _message() -> tuple[dict[str, str], bytes]:
    """Return connection header and bytes of a message as the simulator publishes it."""
    from sensor_msgs.msg import JointState

    message = JointState(
        name=[joint.name for joint in load_robot().twin_joints],
        position=[0.1] * 4,
        velocity=[0.2] * 4,
    )
    message.effort = [1.0] * 4
    stream = io.BytesIO()
    message.serialize(stream)
    kind = JointState._type, JointState._md5sum, JointState._full_text
    return dict(zip(("type", "md5sum", "message_definition"), kind)), stream.getvalue()


def _ours(folder: Path) -> Callable[[], list[float]]:
    """Return a round through the recorder's writer.

    Its thread, its chunks every 50 ms, its flushes.
    """
    header, data = _message()
    settings = settings_of_the_recorder()

    def round_() -> list[float]:
        file = folder / "ours.bag"
        file.unlink(missing_ok=True)
        begun = time.perf_counter()
        writer = BagWriter(file, settings)
        for number in range(WRITES):
            writer.put(
                "/twin/joint_states", header, data, 1_700_000_000_000_000_000 + 5_000_000 * number
            )
        status = writer.close()
        seconds = time.perf_counter() - begun
        assert status.messages == WRITES, f"{status.messages} of {WRITES} written"
        return [WRITES / seconds]

    return round_


def _default(folder: Path) -> Callable[[], list[float]]:
    """Return a round of rosbag.Bag as it is.

    Chunks of 768 KB, raw messages, so that nothing is serialised.
    """
    import rosbag
    import rospy
    from sensor_msgs.msg import JointState

    header, data = _message()
    raw = (header["type"], data, header["md5sum"], JointState)

    def round_() -> list[float]:
        begun = time.perf_counter()
        with rosbag.Bag(str(folder / "default.bag"), "w") as bag:
            for number in range(WRITES):
                stamp = rospy.Time(
                    *divmod(1_700_000_000_000_000_000 + 5_000_000 * number, 1_000_000_000)
                )
                bag.write("/twin/joint_states", raw, stamp, raw=True)
        return [WRITES / (time.perf_counter() - begun)]

    return round_


def _mcap(room: Room, folder: Path) -> Peer | None:
    try:
        _ = room.peers
        return Peer(
            "mcap_file:Writer",
            path=str(folder / "peer.mcap"),
            size=len(_message()[1]),
            messages=WRITES,
        )
    except Exception as error:
        room.say(f"mcap beside it: {error}")
        return None


def recorder_write(room: Room) -> Record:
    """Messages per second until the file is closed."""
    folder = room.place("recorder_write")
    peer = _mcap(room, folder)
    sides = [_ours(folder), _default(folder)]
    if peer is not None:
        sides.append(lambda: peer.ask("round"))
    samples = interleaved(WRITE_ROUNDS, *sides)
    if peer is not None:
        peer.close()
    value, _, spread = of_rounds(samples[0], median, 1.0)
    other, _, other_spread = of_rounds(samples[1], median, 1.0)
    beside = (
        ()
        if peer is None
        else (Beside(f"{peer.version}, default settings", median(samples[2]), "messages/s"),)
    )
    return Record(
        "recorder_write",
        value,
        other,
        "messages/s",
        (Goal("ratio", 1.0, at_least=True),),
        measured=f"BagWriter: {WRITES} sensor_msgs/JointState put, written and closed; a chunk "
        "and a flush every 50 ms",
        against="rosbag.Bag with its default chunks of 768 KB, the same raw messages, closed",
        spread_percent=spread,
        baseline_spread_percent=other_spread,
        rounds=WRITE_ROUNDS,
        beside=beside,
    )


def _publish(room: Room) -> dict[str, int]:
    """Publish numbered messages at their rates; return how many of each topic were sent."""
    from sensor_msgs.msg import JointState

    publishers = {
        topic: room.ros.publisher(topic, JointState, subscribers=2, queue_size=1000)
        for topic in TOPICS
    }
    sent, due = dict.fromkeys(TOPICS, 0), dict.fromkeys(TOPICS, 0.0)
    message = JointState(
        name=["a", "b", "c", "d"], position=[0.0] * 4, velocity=[0.0] * 4, effort=[0.0] * 4
    )
    begun = time.monotonic()
    while (now := time.monotonic() - begun) < RECORDED_S:
        for topic, rate in TOPICS.items():
            while due[topic] <= now:
                message.header.frame_id = f"{sent[topic]}"
                publishers[topic].publish(message)
                sent[topic] += 1
                due[topic] += 1.0 / rate
        time.sleep(0.001)
    return sent


def _kept(file: Path) -> int:
    """Return how many messages can be read of a torn recording; a bag that has none is empty."""
    if not file.is_file() or not file.stat().st_size:
        return 0
    try:
        with open_bag(file) as bag:
            return sum(bag.count(topic) for topic in TOPICS)
    except Exception:
        return 0


def recorder_loss(room: Room) -> Record:
    """Record for half a minute, kill the recorder with -9 on the way, count the loss."""
    from scara_msgs.srv import StartRecording

    folder, ros = room.place("recorder_loss"), room.ros
    recorder = ros.run("cell_recorder", "recorder", f"_directory:={folder}")
    bare_file, file = folder / "default.bag", folder / "ours.bag"
    topics = [ros.name(topic) for topic in TOPICS]
    bare = ros.stage.start(
        sys.executable, "-m", "bench.bare_nodes", "record", str(bare_file), *topics
    )
    assert ros.service("recorder/start", StartRecording, timeout=30.0)(path=str(file)).success
    room.say(f"recording {RECORDED_S:g} s")
    sent = sum(_publish(room).values())
    for process in (recorder, bare):
        process.signal(signal.SIGKILL)
        process.wait(5.0)
    ours, default = (100.0 * (sent - _kept(found)) / sent for found in (file, bare_file))
    ros.stage.processes = [
        process for process in ros.stage.processes if process not in (recorder, bare)
    ]
    return Record(
        "recorder_loss",
        ours,
        default,
        "%",
        (Goal("ours", 0.5),),
        measured=f"{sent} messages at 650 a second to the recorder node, killed with -9 as the "
        "last one left; our repair reads",
        against="a bare rospy node that writes the same topics with rosbag.Bag, killed and read in "
        "the same way",
        statistic="once",
    )


def report(room: Room) -> Record:
    """Read and analyse ten minutes.

    Drawing takes longer the more experiments there are, and is no part of it.
    """
    folder = room.place("report")
    bag = long_bag(room, folder / "long.bag")
    times = []
    for number in range(3):
        room.say(f"reading and analysing {DURATION_S:g} s, {number + 1} of 3")
        begun = time.perf_counter()
        run, _, results = analyse_bag(bag)
        times.append(time.perf_counter() - begun)
    duration = run.duration
    size = bag.stat().st_size / 1e6
    bag.unlink()
    speeds = [duration / seconds for seconds in times]
    return Record(
        "report",
        statistics.median(speeds),
        None,
        "x real time",
        (Goal("ours", 100.0, at_least=True),),
        measured=f"twin_experiments' analyse_bag on a cell's recording of {duration:.0f} s, "
        f"{size:.0f} MB, "
        f"{sum(run.topics.values())} messages, {len(results)} experiments",
        against="none",
        rounds=len(times),
        spread_percent=100.0 * (max(speeds) - min(speeds)) / statistics.median(speeds),
        beside=(Beside("seconds", statistics.median(times), "s"),),
    )
