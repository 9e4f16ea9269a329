"""Bags as a run would leave them, written by the test: known lag, offset and noise."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable, Iterable
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from rosbags.rosbag1 import Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from scara_config import files_in_force, load_robot
from twin_experiments.metrics.series import Array

from harness.workspace import ROOT

ORIGIN_NS = 1_900_000_000_123_456_789
JOINTS = ("joint_1", "joint_2", "joint_3", "table_joint")
P1, P2, P3 = (
    np.array(p)
    for p in (
        (0.0, 0.0, -0.16, 0.0),
        (-0.249962, 1.214750, -0.06, 0.0),
        (-0.857964, 1.214750, 0.0, 0.0),
    )
)
CYCLE = (P1, P2, P3, P1, P2, P3, P1)
REST_S, MOVE_S = 0.8, 0.6
DURATION_S = len(CYCLE) * REST_S + (len(CYCLE) - 1) * MOVE_S


def article_motion(times: Array) -> tuple[Array, Array]:
    """Return joint positions and velocities of P1 P2 P3 P1 P2 P3 P1 with rests.

    Quintic, so rests are exact.
    """
    positions, velocities = np.tile(P1, (len(times), 1)), np.zeros((len(times), 4))
    for i, (here, there) in enumerate(pairwise(CYCLE)):
        u = np.clip((times - (i + 1) * REST_S - i * MOVE_S) / MOVE_S, 0.0, 1.0)[:, None]
        positions += (there - here) * (10.0 * u**3 - 15.0 * u**4 + 6.0 * u**5)
        velocities += (there - here) * (30.0 * u**2 - 60.0 * u**3 + 30.0 * u**4) / MOVE_S
    return positions, velocities


class Sample(NamedTuple):
    """One message to be written; ``at`` [s] is its time of receipt after the start of the bag."""

    at: float
    topic: str
    kind: str
    message: Any


@cache
def _types() -> Any:
    """Return the standard types and those of the cell."""
    store, folder = get_typestore(Stores.ROS1_NOETIC), ROOT / "src" / "scara_msgs" / "msg"
    for place in ("Decision", "CoreInput", "RobotData", "what_if/MotionOutcome"):
        text, name = (folder / f"{place}.msg").read_text(), Path(place).name
        store.register(get_types_from_msg(text, f"scara_msgs/msg/{name}"))
    return store


class BagMaker:
    """Collects messages and writes them in order of time."""

    def __init__(self, namespace: str = "") -> None:
        self.store = _types()
        self.namespace = namespace
        self.samples: list[Sample] = []

    def stamp(self, at: float) -> Any:
        """Return a ROS time."""
        total = ORIGIN_NS + round(at * 1e9)
        return self.store.types["builtin_interfaces/msg/Time"](total // 10**9, total % 10**9)

    def header(self, at: float) -> Any:
        """Return a header."""
        return self.store.types["std_msgs/msg/Header"](0, self.stamp(at), "")

    def add(self, at: float, topic: str, kind: str, *fields: Any) -> None:
        """Add one message."""
        self.samples.append(Sample(at, topic, kind, self.store.types[kind](*fields)))

    def marker(self, at: float, text: str) -> None:
        """Add a marker of an experiment."""
        self.add(at, "experiment/marker", "std_msgs/msg/String", text)

    def text(self, at: float, topic: str, text: str) -> None:
        """Add a string."""
        self.add(at, topic, "std_msgs/msg/String", text)

    def joint_states(
        self, topic: str, names: Iterable[str], stamps: Array, positions: Array, velocities: Array
    ) -> None:
        """Add joint states that are received 1 ms after they were true."""
        names = list(names)
        for stamp, position, velocity in zip(stamps, positions, velocities):
            header = self.header(stamp)
            self.add(
                stamp + 1e-3,
                topic,
                "sensor_msgs/msg/JointState",
                header,
                names,
                position,
                velocity,
                np.zeros(len(names)),
            )

    def write(self, path: Path) -> Path:
        """Write the bag."""
        with Writer(path) as writer:
            connections: dict[str, Any] = {}
            for at, topic, kind, message in sorted(self.samples, key=lambda sample: sample.at):
                name = topic if topic.startswith("/") else f"{self.namespace}/{topic}"
                if name not in connections:
                    connections[name] = writer.add_connection(name, kind, typestore=self.store)
                writer.write(
                    connections[name],
                    ORIGIN_NS + round(at * 1e9),
                    self.store.serialize_ros1(message, kind),
                )
        return path


class Pair(NamedTuple):
    """How the follower differs from the leader in a bag that imitates a run.

    ``without`` names topics that are missing; ``silent`` is a topic and the experiment during which
    nothing came on it; ``hole`` is a topic and the times [s] within each experiment between which
    nothing came; after ``frozen_after`` [s] nothing moves; ``plant`` is the text of real/plant.
    Within ``pause`` [s] of each experiment nothing at all was received; ``kick`` says from when to
    when [s] the follower's joint_3 is how much higher [m]; ``real`` is the topic of the real side.
    ``outcomes`` are times [s] of scara_msgs/MotionOutcome with its fields behind the header.
    """

    lag_s: float = 0.005
    offset: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    noise: float = 0.0
    configuration: str | None = None
    without: tuple[str, ...] = ()
    silent: tuple[str, str] = ("", "")
    hole: tuple[str, float, float] = ("", 0.0, 0.0)
    frozen_after: float = 1e9
    plant: str | None = None
    pause: tuple[float, float] = (0.0, 0.0)
    kick: tuple[float, float, float] = (0.0, 0.0, 0.0)
    real: str = "real/ground_truth"
    outcomes: tuple[tuple[float, tuple[Any, ...]], ...] = ()


def imitate(
    maker: BagMaker,
    pair: Pair,
    experiments: tuple[str, ...] = ("real_leads", "twin_leads"),
) -> None:
    """Add a whole run: markers, both sides, ages, decisions, a warning."""
    generator = np.random.default_rng(7)
    start = 0.5
    for name in experiments:
        maker.marker(start, f"start {name}")
        for topic, rate, delayed in (
            (pair.real, 250.0, name == "twin_leads"),
            ("twin/joint_states", 200.0, name == "real_leads"),
        ):
            times = np.arange(-0.1, DURATION_S + 0.1, 1.0 / rate)
            if topic == pair.hole[0]:
                times = times[(times < pair.hole[1]) | (times > pair.hole[2])]
            positions, velocities = article_motion(
                np.minimum(times, pair.frozen_after) - pair.lag_s * delayed
            )
            positions = (
                positions
                + np.array(pair.offset) * delayed
                + generator.normal(0.0, 1.0, positions.shape) * pair.noise
            )
            kicked = (times > pair.kick[0]) & (times < pair.kick[1]) & delayed
            positions[:, 2] += kicked * pair.kick[2]
            if (topic, name) == pair.silent:
                continue
            names = list(JOINTS)
            if topic == pair.real:
                names.insert(3, "joint_4")
                positions, velocities = (
                    np.insert(positions, 3, 0.5, axis=1),
                    np.insert(velocities, 3, 0.0, axis=1),
                )
            maker.joint_states(topic, names, start + times, positions, velocities)
        maker.marker(start + DURATION_S, f"end {name}")
        start += DURATION_S + 1.0
    _say(maker, pair, "twin" if experiments[0] == "twin_leads" else "real")
    for number in range(len(experiments)):
        begun = 0.5 + number * (DURATION_S + 1.0)
        maker.samples = [
            sample
            for sample in maker.samples
            if not pair.pause[0] < sample.at - begun < pair.pause[1]
        ]
    maker.samples = [sample for sample in maker.samples if sample.topic not in pair.without]


def _say(maker: BagMaker, pair: Pair, leader: str) -> None:
    """Add configuration, the decision who leads first, a warning and stamped set points.

    The set points are received 2 ms after their time.
    """
    if pair.plant is not None:
        maker.text(0.0, "real/plant", pair.plant)
    if pair.configuration is not None:
        maker.text(0.0, "twin_controller/configuration", pair.configuration)
    decision: tuple[Any, ...] = (
        maker.header(1.0),
        1,
        "IDLE",
        f"{leader} moved",
        f"{leader.upper()}_LEADS",
        leader,
        [],
        "the real robot moved first" if leader == "real" else "the twin moved first",
        1.0,
        np.nan,
        1e-3,
        "at the robot",
    )
    maker.add(1.0, "twin_controller/decisions", "scara_msgs/msg/Decision", *decision)
    types = maker.store.types
    value = types["diagnostic_msgs/msg/KeyValue"]("age", "12")
    for at, level in ((1.0, 0), (2.0, 1), (3.0, 1), (4.0, 0)):
        status = types["diagnostic_msgs/msg/DiagnosticStatus"](
            level, "link", "late <&>", "", [value]
        )
        maker.add(
            at, "/diagnostics", "diagnostic_msgs/msg/DiagnosticArray", maker.header(at), [status]
        )
    for at, fields in pair.outcomes:
        outcome = "scara_msgs/msg/MotionOutcome"
        maker.add(at, "what_if/outcomes", outcome, maker.header(at), *fields)
    duration = types["builtin_interfaces/msg/Duration"](0, 10_000_000)
    empty = np.zeros(0)
    point = types["trajectory_msgs/msg/JointTrajectoryPoint"](empty, empty, empty, empty, duration)
    for at in np.arange(1.0, 3.0, 0.01):
        maker.add(
            at + 0.012,
            "joint_pose_controller/follow",
            "trajectory_msgs/msg/JointTrajectory",
            maker.header(at),
            ["joint_1"],
            [point],
        )


@pytest.fixture(scope="session")
def make_bag(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Path]:
    """Return a function that writes a bag like that of a whole run into a folder of its own.

    The same bag is made once and copied.
    """
    made: dict[str, Path] = {}

    def make(
        namespace: str = "",
        experiments: tuple[str, ...] = ("real_leads", "twin_leads"),
        **options: Any,
    ) -> Path:
        bag, pair = tmp_path_factory.mktemp("bag") / "run.bag", Pair(**options)
        key = repr((namespace, experiments, pair))
        if key not in made:
            maker = BagMaker(namespace)
            imitate(maker, pair, experiments)
            made[key] = maker.write(tmp_path_factory.mktemp("made") / "run.bag")
        return Path(shutil.copyfile(made[key], bag))

    return make


@pytest.fixture(scope="session")
def bag_maker() -> type[BagMaker]:
    """Return what writes bags message by message."""
    return BagMaker


@pytest.fixture
def recorded_configuration() -> str:
    """Return the shipped configuration as the twin controller publishes it."""
    files = {name: path.read_text() for name, path in files_in_force(ROOT / "config").items()}
    return json.dumps(files)


@pytest.fixture
def fastest_joint_percent() -> float:
    """Return the fastest joint of the imitated run in percent of its largest speed in robot.yaml.

    A quintic's largest speed is 15/8 of its mean: joint_1 and joint_2 turn by up to 1.214750 rad
    within 0.6 s, joint_3 goes 0.16 m.
    """
    joints = {joint.name: joint.velocity for joint in load_robot(ROOT / "config").joints}
    return max(
        187.5 * abs(there[i] - here[i]) / MOVE_S / joints[name]
        for here, there in pairwise(CYCLE)
        for i, name in enumerate(JOINTS)
    )


@pytest.fixture
def largest_tool_speed() -> float:
    """Return the tool's largest speed in the imitated run [m/s].

    It comes from the chain rule of the plane's two links.
    """
    positions, velocities = article_motion(np.arange(0.0, DURATION_S, 1e-3))
    first, both = positions[:, 0], positions[:, 0] + positions[:, 1]
    turn, turn_both = velocities[:, 0], velocities[:, 0] + velocities[:, 1]
    x = -0.35 * np.sin(first) * turn - 0.3 * np.sin(both) * turn_both
    y = 0.35 * np.cos(first) * turn + 0.3 * np.cos(both) * turn_both
    return float(np.sqrt(x**2 + y**2 + velocities[:, 2] ** 2).max())
