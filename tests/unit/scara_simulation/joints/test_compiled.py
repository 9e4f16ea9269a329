"""The joint loops in C give the bits of the Python that says what is right."""

from __future__ import annotations

import hashlib
import random
import struct
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace

import msgspec
import pytest
from harness.running.thorough import examples, thorough
from harness.virtual_cell.files import CellFiles, load_files
from harness.virtual_cell.simulator import build_simulation, open_world
from scara_control.joint_motion import JointMotion
from scara_control.joint_track import JointTrack
from scara_control.motion.plan import plan_move
from scara_simulation.joints.cells import step_efforts
from scara_simulation.joints.control import JointControl
from scara_simulation.joints.loop import JointLoop
from scara_simulation.simulation import Simulation

CHUNK, STEPS = 10, examples(8_000, 20_000)
"""Steps between two packets, and in all: 20 s."""
WITHOUT_C = """
import sys
sys.modules["_scara_loops"] = None
sys.path[:0] = sys.argv[2:]
from scara_simulation.joints import cells
assert cells.step_efforts is None and cells.Cells is cells.PlainCells
from test_compiled import motion_hash
print(motion_hash("fanuc_sr6ia", 2000, sys.argv[1] == "c"))
"""


class Driver:
    """Commands the joints at random, with all that a loop can be told; the same for a seed."""

    def __init__(self, files: CellFiles, simulation: Simulation, seed: int) -> None:
        self._random, self._simulation = random.Random(seed), simulation
        self._joints, self._gains = files.robot.twin_joints, files.gains
        self._names = [joint.name for joint in self._joints]
        self._here = tuple(files.robot.home_positions)
        self._begun, self._path, self._silent = 0.0, None, 0
        self._points = 1

    def command(self) -> None:
        """Send the packet that is due, or something else now and then."""
        chance, control = self._random.random(), self._simulation.control
        if chance < 0.02:
            self._direct(self._random.choice(self._joints).name)
        elif chance < 0.03:
            control.stop()
        elif chance < 0.04:
            self._silent = self._random.randint(1, 40)
        elif chance < 0.05:
            control.postpone(0.001 * self._random.randint(1, 30))
        elif chance < 0.06:
            control.limit_speed(self._random.choice([20.0, 60.0, 100.0]))
        elif chance < 0.07:
            k = self._random.randrange(len(self._names))
            control.set_gains(self._names[k], self._gains[k])
        if self._silent:
            self._silent -= 1
        elif chance < 0.97:
            self._follow()

    def _direct(self, name: str) -> None:
        control, joint = self._simulation.control, self._joints[self._names.index(name)]
        if self._random.random() < 0.5:
            control.command_position(name, self._random.uniform(joint.lower, joint.upper))
        else:
            speed = self._random.uniform(-joint.velocity, joint.velocity)
            control.command_velocity(name, speed, self._simulation.now + 0.2)

    def _follow(self) -> None:
        """Send set points of a path; at its end another one begins, at times with a jump."""
        now = self._simulation.now
        if self._path is None or now - self._begun > self._path.duration + 0.1:
            if self._random.random() < 0.3:
                self._here = self._pose()
            target, self._points = self._pose(), self._random.choice([1, 2, 16])
            speed = self._random.choice([30.0, 100.0])
            self._path = plan_move(self._joints, JointMotion.at_rest(self._here), target, speed)
            self._here, self._begun = target, now
        motions = [self._path.at(now - self._begun + 0.01 * k) for k in range(self._points)]
        ahead = self._random.choice([0.0, 0.0, 0.003, -0.004])
        track = JointTrack(
            [now + ahead + 0.01 * k for k in range(self._points)],
            [motion.q for motion in motions],
            [motion.qdot for motion in motions],
            [motion.qddot for motion in motions],
            extrapolation_limit=0.05,
            stop_accelerations=[joint.acceleration for joint in self._joints],
        )
        control, count = self._simulation.control, len(self._names)
        if self._random.random() < 0.5:
            control.command_track(self._names, track)
            return
        for column, name in enumerate(self._names):  # the same columns, counted from the end
            control.loops[self._names.index(name)].command_track(track, column - count)

    def _pose(self) -> tuple[float, ...]:
        return tuple(
            joint.lower + self._random.uniform(0.05, 0.95) * (joint.upper - joint.lower)
            for joint in self._joints
        )


def play(robot: str, steps: int, *, compiled: bool, feed_forward: bool = True) -> Iterator[bytes]:
    """Yield the bits of all that a motion shows, packet by packet."""
    files = load_files(robot)
    config = msgspec.structs.replace(files.simulation, feed_forward=feed_forward)
    files = replace(files, simulation=config)
    with open_world(files) as world:
        simulation = build_simulation(world, files, 0, compiled=compiled)
        driver = Driver(files, simulation, seed=1)
        for _ in range(steps // CHUNK):
            driver.command()
            for shot in simulation.advance(CHUNK):
                values = (*shot.positions, *shot.velocities, *shot.efforts)
                yield struct.pack(f"<{len(values)}d", *values)
            yield b"".join(map(_kept, simulation.control.loops))


def _kept(loop: JointLoop) -> bytes:
    """Return what a loop keeps, bit for bit."""
    counts = (loop.saturated_steps, loop.limited_steps, loop.holding)
    values = (loop._integral, loop._last_velocity, loop.position_setpoint, *loop._wanted)
    return repr((loop.mode, *counts)).encode() + struct.pack(f"<{len(values)}d", *values)


def motion_hash(robot: str, steps: int, compiled: bool) -> str:
    """Return the hash of all that a motion shows."""
    found = hashlib.sha256()
    for bits in play(robot, steps, compiled=compiled):
        found.update(bits)
    return found.hexdigest()


def test_the_loops_were_built() -> None:
    """Else the tests below would compare Python with itself."""
    assert step_efforts is not None


@pytest.mark.parametrize(
    ("robot", "feed_forward"),
    [
        ("articulated_six", True),
        ("fanuc_sr6ia", False),
        *thorough(("fanuc_sr6ia", True), ("fanuc_sr3ia", True)),
    ],
)
def test_c_gives_the_bits_of_python(robot: str, feed_forward: bool) -> None:
    """All commands with jumps, gaps, pauses, limits, 20 s by night; and the article's plain PID."""
    by_c, by_python = (
        play(robot, STEPS, compiled=compiled, feed_forward=feed_forward)
        for compiled in (True, False)
    )
    pairs = zip(by_c, by_python, strict=True)
    for number, (one, other) in enumerate(pairs):
        assert one == other, f"differs first at record {number}"


def test_without_c_the_cell_moves_alike() -> None:
    """A workspace that was not built for this interpreter computes the same bits in Python."""
    by_c = motion_hash("fanuc_sr6ia", 2000, True)
    found = subprocess.run(
        [sys.executable, "-c", WITHOUT_C, "c", __file__.rsplit("/", 1)[0], *sys.path],
        capture_output=True,
        text=True,
        timeout=100.0,
        check=True,
    )
    assert found.stdout.split()[-1] == by_c


def test_a_joint_that_rests_after_its_set_points_is_left_to_c(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A cell stands most of the time: no step of it asks Python for a set point."""
    files = load_files("fanuc_sr6ia")
    names = [joint.name for joint in files.robot.twin_joints]
    with open_world(files) as world:
        simulation = build_simulation(world, files, 0)
        count, here = len(names), files.robot.home_positions
        track = JointTrack(
            [simulation.now, simulation.now + 0.1],
            [here, [q + 0.01 for q in here]],
            [[0.1] * count] * 2,
            [[0.0] * count] * 2,
            extrapolation_limit=0.05,
            stop_accelerations=[2.0] * count,
        )
        simulation.control.command_track(names, track)
        simulation.advance(1000)
        monkeypatch.delattr(JointLoop, "reference")
        monkeypatch.delattr("scara_simulation.track_queue.TrackQueue.sample")
        simulation.advance(1000)
        assert not any(loop._wanted[1] for loop in simulation.control.loops)


@pytest.mark.parametrize(
    ("instead", "error", "words"),
    [
        ({0: ()}, TypeError, "the first a list of 16 loops at most"),
        ({0: [object()]}, TypeError, "has to hold compiled cells"),
        ({2: [0.0, 0.0]}, ValueError, "2 numbers for 1"),
        ({3: ["x"]}, TypeError, "must be real number"),
        ({5: lambda *_: [0.0, 0.0]}, ValueError, "2 numbers for 1"),
        ({5: lambda *_: 1 / 0}, ZeroDivisionError, "division by zero"),
    ],
)
def test_what_does_not_fit_is_refused(
    instead: dict[int, object], error: type[Exception], words: str
) -> None:
    """C reads no memory that is not there, and passes on what the inverse dynamics raises."""
    arguments: list[object] = [[_loop()], 0.0, [0.0], [0.0], 1e-3, None, 0.0, 0.0, 1.5]
    assert step_efforts(*arguments) == [0.0]
    for place, value in instead.items():
        arguments[place] = value
    with pytest.raises(error, match=words):
        step_efforts(*arguments)


def _loop() -> JointLoop:
    files = load_files("fanuc_sr6ia")
    with open_world(files) as world:
        control: JointControl = build_simulation(world, files, 0).control
    loop = control.loops[1]
    loop.reset(0.0)
    return loop


@pytest.mark.parametrize("coefficients", [(), (1.0, 2.0), (0.0,) * 7])
def test_a_piece_is_a_quintic_or_an_extrapolation(coefficients: tuple[float, ...]) -> None:
    """No other count of coefficients is read."""
    with pytest.raises(ValueError, match="3 or 6 coefficients"):
        _loop().keep_piece((1.0, 0.0, 0.0, 1.0, 1.0, coefficients))  # type: ignore[arg-type]
