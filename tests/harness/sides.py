"""Two ideal robots in virtual time.

A real one that runs programs or follows set points, and a twin that moves or follows.

Nothing here shares code with the twin controller. Positions are SI, in the order of the twin's
joints.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable

from scara_config import load_robot
from twin_controller.core.actions import Command, FollowTwin, SendTwin

from harness.workspace import ROOT

ROBOT = load_robot(ROOT / "config")
SCALE = tuple(joint.scale for joint in ROBOT.twin_joints)
Joints = tuple[float, ...]
Path_ = Callable[[float], Joints]

FOLLOW_TIMEOUT = 0.1
FOLLOW_START = (3.0, 3.0, 5.0, 3.0)
"""How far, in degrees and millimetres, the twin lets a stream begin from where it is.

config/motion.yaml.
"""
STOPPING = 0.04
"""How long the twin takes to end a stream [s]."""
BRAKING = 0.15
"""How long the twin takes to slow a move down to standstill [s]."""
END = 1e3


def ramp(start: Joints, end: Joints, duration: float) -> Path_:
    """Return a smooth path between two poses."""

    def at(t: float) -> Joints:
        u = min(max(t / duration, 0.0), 1.0)
        s = u**3 * (10 - 15 * u + 6 * u * u)
        return tuple(a + s * (b - a) for a, b in zip(start, end))

    return at


def rate(path: Path_ | None, t: float) -> Joints:
    """Return the velocity on a path by a central difference."""
    if path is None:
        return (0.0,) * len(SCALE)
    return tuple((b - a) / 2e-4 for a, b in zip(path(t - 1e-4), path(t + 1e-4)))


class RealSide:
    """The real robot: programs of its own, a stream program, hold, drives, an alarm."""

    def __init__(self, q: Joints, stream_lag: float) -> None:
        """Stand at ``q``; set points are reached ``stream_lag`` [s] after they came."""
        self.real_q = q
        self.real_up = False
        self.own_program = self.streaming = self.fault = False
        self.hold_away = self.program_paused = False
        self.drives = self.starts_stream = True
        # At what its mode switch stands; empty: it does not tell.
        self.operation_mode = ""
        # CSTOPI ends its program; else only HOLD stops it. What was asked for beside a program.
        self.cancels, self.queued = True, False
        self.estop_pressed = self.fault_persists = False
        # What its own program moves with, of its override.
        self.program_percent = 100.0
        self.real_path: Path_ | None = None
        self.real_path_start = 0.0
        self.setpoints: deque[tuple[float, Joints]] = deque()
        # How many set points it takes ahead of their time, and their numbers; 0: none.
        self.places = 0
        self.ring_read = 0
        self.ahead: dict[int, tuple[float, Joints]] = {}
        self.stream_lag = stream_lag

    @property
    def paused(self) -> bool:
        """Whether a program is paused, or the robot is held."""
        return self.hold_away or self.program_paused

    @paused.setter
    def paused(self, paused: bool) -> None:
        """Hold the robot at its pendant, or let it go on there, whoever holds it."""
        self.program_paused = paused
        self.hold_away = self.hold_away and paused

    def run_program(self, path: Path_, now: float) -> None:
        """Start a program on the robot's own side, if it can start."""
        if self.drives and not self.fault and not self.paused:
            self.own_program, self.streaming = True, False
            self.real_path, self.real_path_start = path, now

    def end_program(self) -> None:
        """End it; the robot stays where it is. A stream that waited for it begins."""
        self.own_program, self.program_paused, self.real_path = False, False, None
        self.streaming, self.queued = self.streaming or self.queued, False

    def press_estop(self) -> None:
        """Press the robot's emergency stop; it stays pressed until ``estop_pressed`` is cleared."""
        self.estop_pressed = True
        self._drives_off()

    def raise_alarm(self) -> None:
        """Stop by an alarm; its cause stays until ``fault_persists`` is cleared."""
        self.fault = self.fault_persists = True
        self.streaming = self.queued = False
        self.end_program()

    def command_real(self, do: Command) -> None:
        """Obey one command."""
        if do in (Command.STOP_REAL, Command.END_AT_REST):
            self.hold_away, self.queued = self.hold_away or do is Command.STOP_REAL, False
            if self.cancels:
                self.streaming = False
                self.end_program()
            elif do is Command.STOP_REAL:
                self.program_paused = self.own_program or self.streaming
            self._forget_setpoints()
        elif do is Command.HOLD_REAL:
            self.hold_away = True
            self.program_paused = self.own_program or self.streaming
            self.ahead = {}
        elif do is Command.END_STREAM:
            self._forget_setpoints()
        elif do is Command.GIVE_HOLD_BACK:
            self.hold_away = False
        elif do is Command.RELEASE_REAL:
            self.hold_away = self.program_paused = False
        elif do is Command.CONTINUE_STREAM:
            self.program_paused = self.program_paused and self.hold_away
        elif do is Command.ESTOP_REAL:
            self._drives_off()
        elif do is Command.RESET_REAL:
            self.drives, self.fault = not self.estop_pressed, self.fault_persists
            self.hold_away = self.program_paused = False
        elif (
            do is Command.START_STREAM
            and self.starts_stream
            and self.drives
            and not (self.fault or self.hold_away)
        ):
            self.queued = self.own_program or self.streaming
            self.streaming = not self.own_program

    def move_real(self, now: float) -> None:
        """Let a millisecond pass."""
        if self.paused or not self.drives:
            self.real_path_start += 0.001
        elif self.real_path:
            self.real_q = self.real_path(now - self.real_path_start)
        elif self.streaming:
            self._take_ahead(now - self.stream_lag)
            while self.setpoints and self.setpoints[0][0] <= now - self.stream_lag:
                self.real_q = self.setpoints.popleft()[1]

    def give_ahead(self, points: dict[int, tuple[float, Joints]], newest: int) -> None:
        """Take set points ahead of their time; nothing behind ``newest`` counts any longer."""
        self.ahead |= points
        self.ahead = {
            number: point
            for number, point in self.ahead.items()
            if (newest - number) % 32760 < self.places
        }

    def _take_ahead(self, now: float) -> None:
        due = [(point, number) for number, point in self.ahead.items() if point[0] <= now]
        for (_, q), number in sorted(due):
            self.real_q, self.ring_read = q, number
            del self.ahead[number]

    def real_at(self, t: float) -> tuple[Joints, Joints]:
        """Return position and velocity at ``t``, at most 2 ms ago."""
        if self.real_path is None or self.paused or not self.drives:
            return self.real_q, (0.0,) * len(SCALE)
        elapsed = t - self.real_path_start
        return self.real_path(elapsed), rate(self.real_path, elapsed)

    def _drives_off(self) -> None:
        self.drives = self.streaming = self.queued = self.program_paused = False
        self.end_program()
        self._forget_setpoints()

    def _forget_setpoints(self) -> None:
        self.setpoints.clear()
        self.ahead = {}


class TwinSide:
    """The twin: announced moves, streams to follow, jogging and commands.

    Moves slow down smoothly; the commands are STOP PAUSE RESUME ESTOP RESET.
    """

    def __init__(self, q: Joints) -> None:
        """Stand at ``q``."""
        self.twin_q = q
        self.twin_up = False
        self.motion = "idle"
        self.command_id = 0
        self.limit = self.override = 100.0
        # Where the twin says that its move ends, and how fast its fastest joint gets [percent].
        self.announced: tuple[tuple[float, ...], float] = ((), 0.0)
        self.announce = 0.1
        self.twin_path: Path_ | None = None
        self.twin_time = 0.0
        self.pace = 0.0
        self.jog: Path_ | None = None
        self.jog_start = 0.0
        self.follow: FollowTwin | None = None
        self.followed = self.heard = self.ended = -1e9
        self.barred = False

    def move_twin(self, path: Path_) -> None:
        """Let the twin move by its own pose controller, announced as that does."""
        if self.motion in ("idle", "announcing", "moving"):
            self.motion, self.twin_path, self.twin_time, self.pace = (
                "announcing",
                path,
                -self.announce,
                1.0,
            )

    def jog_twin(self, path: Path_, now: float) -> None:
        """Let the twin move without its pose controller: not announced, no plan."""
        self.jog, self.jog_start = path, now

    def command_twin(self, do: Command, number: int, now: float) -> None:
        """Obey one motion command with this id."""
        self.command_id = number
        drives = self.motion in ("announcing", "moving", "pausing", "paused")
        if do in (Command.STOP_TWIN, Command.ESTOP_TWIN):
            self.barred = self.barred or now - self.heard <= FOLLOW_TIMEOUT
            self.ended = now if self.motion == "following" else self.ended
            estopped = do is Command.ESTOP_TWIN or self.motion == "estopped"
            self.motion = "estopped" if estopped else "stopping" if drives else "idle"
            self.follow = self.jog = None
        elif do is Command.YIELD_TWIN:
            self.motion = "stopping" if drives else self.motion
            self.jog = None
        elif do is Command.RESET_TWIN and self.motion == "estopped":
            self.motion = "idle"
        elif do is Command.PAUSE_TWIN and drives:
            self.motion = "pausing"
        elif do is Command.RESUME_TWIN and self.motion in ("pausing", "paused"):
            self.motion = "moving"

    def take_follow(self, action: FollowTwin, now: float) -> None:
        """Take a set point, or refuse it.

        After a stop, while a move runs, or too far away to begin.
        """
        gap, self.heard = now - self.heard, now
        self.barred = self.barred and gap <= FOLLOW_TIMEOUT
        if self.barred or self.shown_motion(now) not in ("idle", "following"):
            return
        here = action.points[0]
        off = [abs(a - b) / scale for a, b, scale in zip(here.q, self.twin_q, SCALE)]
        if self.motion == "following" or all(
            gap <= allowed for gap, allowed in zip(off, FOLLOW_START)
        ):
            self.motion, self.follow, self.followed = "following", action, now

    def shown_motion(self, now: float) -> str:
        """Return the state that the pose controller shows."""
        return "stopping" if self.motion == "idle" and now - self.ended < STOPPING else self.motion

    def move_simulated(self, now: float, stamp: float) -> None:
        """Let a millisecond pass; ``stamp`` is the twin's own time."""
        if self.jog is not None:
            self.twin_q = self.jog(now - self.jog_start)
            self.jog = None if self.twin_q == self.jog(END) else self.jog
        elif self.motion == "following" and self.follow is not None:
            here = self.follow.points[0]
            age = max(-0.05, min(stamp - self.follow.stamp, 0.05))
            self.twin_q = tuple(
                p + age * (v + 0.5 * age * a) for p, v, a in zip(here.q, here.qdot, here.qddot)
            )
            if now - self.followed > FOLLOW_TIMEOUT:
                self.motion, self.follow, self.ended = "idle", None, now
        elif self.twin_path is not None and self.motion != "paused":
            self._drive(self.twin_path)

    def _drive(self, path: Path_) -> None:
        """Go on along the path, at a pace that is ramped between standstill and full."""
        self.twin_time, self.pace = self._ahead(self.twin_time, self.pace)
        self.twin_q = path(self.twin_time)
        if self.motion == "announcing" and self.twin_time >= 0.0:
            self.motion = "moving"
        if self.motion in ("announcing", "moving"):
            ended = self.twin_q == path(END)
        else:
            ended = self.pace == 0.0
        if ended:
            self.motion = {"pausing": "paused", "estopped": "estopped"}.get(self.motion, "idle")
            self.twin_path = path if self.motion == "paused" else None

    def _ahead(self, time: float, pace: float) -> tuple[float, float]:
        """Return path time and pace a millisecond later."""
        change = 0.001 / BRAKING if self.motion in ("announcing", "moving") else -0.001 / BRAKING
        pace = min(max(pace + change, 0.0), 1.0)
        return time + 0.001 * pace, pace

    def twin_speed(self, now: float) -> Joints:
        """Return the velocity now."""
        if self.jog is not None:
            return rate(self.jog, now - self.jog_start)
        if self.motion == "following" and self.follow is not None:
            return self.follow.points[0].qdot
        if self.twin_path is None or self.motion == "paused":
            return (0.0,) * len(SCALE)
        return tuple(self.pace * v for v in rate(self.twin_path, self.twin_time))

    def coming(self, rows: int) -> list[tuple[Joints, Joints]]:
        """Return position and velocity now and every 10 ms from now on.

        Empty while nothing moves by a path.
        """
        if self.twin_path is None or self.motion in ("idle", "paused"):
            return []
        found, time, pace = [], self.twin_time, self.pace
        for _ in range(rows):
            found.append(
                (self.twin_path(time), tuple(pace * v for v in rate(self.twin_path, time)))
            )
            for _ in range(10):
                time, pace = self._ahead(time, pace)
        return found

    def perform_twin(self, action: SendTwin, now: float) -> None:
        """Obey an action of the twin controller."""
        if not self.twin_up:
            return
        if action.command is not Command.RELEASE_TWIN:
            self.command_twin(action.command, action.id, now)
        elif self.motion == "following":
            self.motion, self.follow = "idle", None
