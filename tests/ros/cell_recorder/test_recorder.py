"""The recorder node: complete bags, late topics, crashes."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
import rosbag
import rospy
from cell_recorder.reading.bag_reader_io import BagError, open_bag
from diagnostic_msgs.msg import DiagnosticArray
from harness.ros import Ros
from harness.running.standstill import MACHINE
from harness.running.thorough import thorough
from sensor_msgs.msg import JointState
from std_msgs.msg import String

from scara_msgs.srv import StartRecording, StopRecording

CONFIG = """
recorder:
  topics: [twin/joint_states, twin_controller/configuration, experiment/marker, /diagnostics]
  write_period_ms: 50.0
  queue_messages: 20000
  min_free_mb: {min_free_mb}
  part_mb: 1000.0
  part_minutes: 15.0
  runs_limit_mb: {runs_limit_mb}
"""


@pytest.fixture(scope="module")
def running(ros_module: Ros) -> tuple[Any, Any, Any]:
    """Start the node with a configuration of the tests; give the process and both services."""
    return start_node(ros_module)


@pytest.fixture
def recorder(running: tuple[Any, Any, Any]) -> tuple[Any, Any, Any]:
    """Give a recorder that does not record; bags have names that no other test gives."""
    running[2]()
    return running


def start_node(
    ros: Ros, min_free_mb: float = 0.0, runs_limit_mb: float = 1000.0
) -> tuple[Any, Any, Any]:
    """Start a recorder whose runs folder is the test's folder."""
    folder = ros.folder / "config"
    folder.mkdir(exist_ok=True)
    (folder / "experiments.yaml").write_text(
        CONFIG.format(min_free_mb=min_free_mb, runs_limit_mb=runs_limit_mb)
    )
    node = ros.run(
        "cell_recorder", "recorder", f"_config_dir:={folder}", f"_directory:={ros.folder}"
    )
    return (
        node,
        ros.service("recorder/start", StartRecording),
        ros.service("recorder/stop", StopRecording),
    )


@contextmanager
def joint_states(publisher: Any, rate: float = 200.0) -> Iterator[list[float]]:
    """Publish numbered joint states.

    Give the list of the times [s] at which they were published.
    """
    sent: list[float] = []
    stop = threading.Event()

    def work() -> None:
        while not stop.wait(1.0 / rate):
            message = JointState(name=["joint_1"], position=[float(len(sent))], velocity=[0.0])
            message.header.stamp = rospy.get_rostime()
            publisher.publish(message)
            sent.append(message.header.stamp.to_sec())

    thread = threading.Thread(target=work)
    thread.start()
    yield sent
    stop.set()
    thread.join()


def numbers(path: str | Path, topic: str) -> list[float]:
    """Return the first joint position of every message of a topic, read with rosbag."""
    with rosbag.Bag(str(path)) as bag:
        return [message.position[0] for _, message, _ in bag.read_messages(topics=[topic])]


def so_far(path: str | Path, topic: str) -> list[Any]:
    """Return the messages of a topic in the file of a recording, which need not have ended."""
    with open_bag(Path(path)) as bag:
        return [message for _, message in bag.messages(topic)]


def wait_for(ros: Ros, path: str | Path, topic: str, such_that: Callable[[Any], bool]) -> None:
    """Wait until the newest message of a topic is such in the file of a recording that goes on."""

    def held() -> bool:
        try:
            found = so_far(path, topic)
        except BagError:
            return False  # nothing was written yet
        return bool(found) and such_that(found[-1])

    ros.wait_until(held, 10.0, f"{topic} in the file")


def wait_for_last(ros: Ros, path: str | Path, sent: list[float]) -> None:
    """Wait until the file of a recording that goes on holds the last joint state that was sent."""
    last = float(len(sent) - 1)
    wait_for(ros, path, "twin/joint_states", lambda message: message.position[0] == last)


def test_stop_answers_the_count_of_a_complete_bag(
    ros_module: Ros, recorder: tuple[Any, Any, Any]
) -> None:
    """What was published between both answers is complete; standard tools read the file."""
    _, start, stop = recorder
    publisher = ros_module.publisher("twin/joint_states", JointState, subscribers=0)
    started = start(path="stop.bag")
    assert (started.success, started.path) == (True, str(ros_module.folder / "stop.bag"))
    # Start answers when published topics are connected: rospy's publisher has answered by then, and
    # counts the connection a moment later.
    ros_module.wait_until(lambda: publisher.get_num_connections() == 1, 0.5, "its connection")
    with joint_states(publisher) as sent:
        ros_module.wait_until(lambda: len(sent) >= 200, 10.0, "200 messages")
    wait_for_last(ros_module, started.path, sent)
    stopped = stop()
    assert stopped.success and stopped.path == started.path
    assert numbers(stopped.path, ros_module.name("twin/joint_states")) == [
        float(i) for i in range(len(sent))
    ]
    with rosbag.Bag(stopped.path) as bag:
        assert bag.get_message_count() == stopped.messages
        stamps = [stamp for _, _, stamp in bag.read_messages()]
    assert stamps == sorted(stamps)
    assert "messages" in ros_module.shell("rosbag", "info", stopped.path)


def test_topics_that_appear_later_and_latched_ones_are_recorded(
    ros_module: Ros, recorder: tuple[Any, Any, Any]
) -> None:
    """The configuration in force is in each bag, whenever the recording starts."""
    _, start, stop = recorder
    ros_module.publisher(
        "twin_controller/configuration", String, subscribers=0, latch=True
    ).publish("configured")
    paths = []
    for name in ("first.bag", "second.bag"):
        started = start(path=name)
        assert started.success
        late = ros_module.publisher("experiment/marker", String, subscribers=1)
        late.publish("start it")
        wait_for(ros_module, started.path, "experiment/marker", lambda _: True)
        paths.append(stop().path)
        late.unregister()
    for path in paths:
        with rosbag.Bag(path) as bag:
            said = {
                topic: message.data
                for topic, message, _ in bag.read_messages()
                if message._type == "std_msgs/String"
            }
        assert said == {
            ros_module.name("twin_controller/configuration"): "configured",
            ros_module.name("experiment/marker"): "start it",
        }


def test_a_killed_recorder_loses_at_most_a_fifth_of_a_second(ros: Ros) -> None:
    """What was received 0.2 s before kill -9 can be read after our reader has repaired a copy."""
    node, start, _ = start_node(ros)
    publisher = ros.publisher("twin/joint_states", JointState, subscribers=0)
    path = Path(start().path)
    ros.wait_until(lambda: publisher.get_num_connections() == 1, 5.0, "its connection")
    begun = MACHINE.now()
    with joint_states(publisher) as sent:
        ros.wait_until(lambda: len(sent) >= 400, 10.0, "400 messages")
        killed = rospy.get_rostime().to_sec()
        node.signal(signal.SIGKILL)
        node.wait(5.0)
    before = path.read_bytes()
    kept = [message.position[0] for message in so_far(path, "twin/joint_states")]
    # What is sent just before the machine stands still is received behind that.
    last = killed - 0.2 - MACHINE.stood_still(begun)
    due = [i for i, at in enumerate(sent) if at <= last]
    assert kept == [float(i) for i in range(len(kept))]
    assert len(kept) >= len(due) > 100
    assert path.read_bytes() == before, "the original is left alone"


@pytest.mark.parametrize("number", [signal.SIGINT, *thorough(signal.SIGTERM)])
def test_a_recorder_that_is_asked_to_end_closes_its_bag(ros: Ros, number: signal.Signals) -> None:
    """Ctrl-C during a recording leaves a complete bag and no error."""
    node, start, _ = start_node(ros)
    publisher = ros.publisher("twin/joint_states", JointState, subscribers=0)
    path = start().path
    assert Path(path).parent.parent == ros.folder and path.endswith("/run.bag")
    ros.wait_until(lambda: publisher.get_num_connections() == 1, 5.0, "its connection")
    with joint_states(publisher) as sent:
        ros.wait_until(lambda: len(sent) >= 50, 10.0, "50 messages")
    wait_for_last(ros, path, sent)
    node.signal(number)
    node.wait(10.0)
    assert "Traceback" not in node.output
    assert len(numbers(path, ros.name("twin/joint_states"))) == len(sent)


def test_a_full_disk_is_an_error_on_diagnostics_and_no_crash(ros: Ros) -> None:
    """The recording ends, the reason is shown and answered by stop, the node lives on."""
    node, start, stop = start_node(ros, min_free_mb=1e6)
    said = ros.collect("/diagnostics", DiagnosticArray)
    assert start(path="run.bag").success

    def error() -> list[str]:
        return [
            s.message
            for m in list(said)
            for s in m.status
            if s.name == ros.name("recorder") and s.level == 2
        ]

    assert "MB free on the disk" in ros.wait_until(error, 5.0, "an ERROR")[0]
    stopped = stop()
    assert not stopped.success and "MB free on the disk" in stopped.message
    assert node.poll() is None
    assert start(path="other.bag").success
    # It ends by itself too; then nobody has to stop it first.
    ros.wait_until(lambda: start(path="third.bag").success, 5.0, "another recording")


def test_wrong_calls_are_refused_with_a_reason(
    ros_module: Ros, recorder: tuple[Any, Any, Any]
) -> None:
    """Nothing is overwritten and nothing stops twice."""
    _, start, stop = recorder
    assert stop().message == "not recording"
    assert start(path="wrong.bag").success
    assert start(path="other.bag").message == "already recording"
    assert stop().success
    again = start(path="wrong.bag")
    assert not again.success and "File exists" in again.message


def test_nothing_is_written_outside_the_runs_folder(
    ros_module: Ros, recorder: tuple[Any, Any, Any]
) -> None:
    """Whoever may call the service may not fill any place of the disk."""
    _, start, stop = recorder
    for wrong in ("/tmp/stolen.bag", "../stolen.bag", "a/../../stolen.bag"):
        refused = start(path=wrong)
        assert not refused.success
        assert f"recordings go into {ros_module.folder} only" in refused.message
        assert stop().message == "not recording"
    assert start(path=str(ros_module.folder / "inside" / "nothing.bag")).success


def test_an_old_recording_makes_room_and_that_is_said(ros: Ros) -> None:
    """The log and /diagnostics say what was removed; an experiment's recording stays."""
    for name in ("old", "experiment"):
        folder = ros.folder / name
        folder.mkdir()
        (folder / "run.bag").write_bytes(b"x" * 2_000_000)
        (folder / "run.removable").write_text("")
        for file in folder.iterdir():
            os.utime(file, (1e9, 1e9))
    (ros.folder / "experiment" / "run.removable").unlink()
    said = ros.collect("/diagnostics", DiagnosticArray)
    node, _, _ = start_node(ros, runs_limit_mb=1.0)

    def told() -> list[str]:
        return [
            s.message
            for m in list(said)
            for s in m.status
            if s.name == ros.name("recorder")
            and {"key": "runs_removed", "value": "1"}
            in [{"key": v.key, "value": v.value} for v in s.values]
        ]

    assert "nothing in it may be removed" in ros.wait_until(told, 10.0, "the diagnostics")[-1]
    ros.wait_until(lambda: f"removed {ros.folder}/old/run.bag" in node.output, 5.0, "the log line")
    assert not (ros.folder / "old").exists()
    assert (ros.folder / "experiment" / "run.bag").exists()
