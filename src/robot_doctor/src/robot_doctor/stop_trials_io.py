"""Try what stops a robot, one means after the other, each after a question; read what it does."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from functools import partial

import msgspec
from scara_config import Robot
from scara_config.modbus_map import ModbusMap
from twin_controller.config import TwinControllerConfig
from twin_controller.modbus.link_io import ModbusLink
from twin_controller.modbus.port_io import LinkLostError
from twin_controller.robot.intake import (
    HEARTBEAT_LOST,
    alarm_text,
    heartbeat_lost,
    is_faulted,
    is_stopping,
)
from twin_controller.robot.signals import Number, Pulse, Signal, Step
from twin_controller.robot_sample import AlarmStatus, ProgramState, ProgramStatus, RobotSample

from robot_doctor.finding import Finding, Group, wrong
from robot_doctor.robot_probe_io import Mover, link_to
from robot_doctor.stop_trials import (
    MEANS,
    MOVES,
    PATIENCE_S,
    WINDOW_S,
    Look,
    Result,
    Trial,
    TrialEnd,
    evenly,
    judge_stop,
    moves,
    question,
    stands,
    too_fast,
)

FIRST_S, STAYS_S = 3.0, 1.0
COMES_S = 30.0
"""So long a person, or the PLC, has to start a program once the question is answered."""
SILENT_S = 0.5
SILENT = "the robot does not answer"
REMEMBERED = 1000
"""Readings: those of ten seconds."""
SLOWEST_PERCENT = 1
"""Override during the trials: at 100 % of a program most joints move at 5 deg/s or less."""
_ACTS: dict[Trial, tuple[Step, ...]] = {
    Trial.HOLD: (Signal("hold", False),),
    Trial.CSTOPI: (Pulse("cstopi"),),
    Trial.IMSTP: (Signal("imstp", False),),
}
_GIVES_BACK: tuple[Step, ...] = (Signal("imstp", True), Signal("hold", True))


class UnexpectedError(Exception):
    """What was not expected while something was tried; the robot is held then."""


def answer(text: str) -> bool:
    """Ask one question; Enter is no.

    Raises:
        UnexpectedError: The answer is neither yes nor no.
    """
    try:
        said = input(f"{text} [y/N] ").strip().lower()
    except EOFError as error:
        raise UnexpectedError("no answer") from error
    if said not in ("y", "yes", "n", "no", ""):
        raise UnexpectedError(f"{said!r} is neither yes nor no")
    return said.startswith("y")


class StopTrials:
    """A connection to a robot on which means of stopping are tried; a context manager.

    Args:
        robot: The profile.
        layout: Its map.
        config: Times of the link.
        address: Of the robot's Modbus server.
        ask: Puts one question to the person at the robot.
        comes: So long a program may take to move the robot after an answer [s].
        stays: So long a robot that stands is watched [s].

    Attributes:
        results: Of the trials so far.
        outputs: Names of all outputs that were seen on.
    """

    def __init__(
        self,
        robot: Robot,
        layout: ModbusMap,
        config: TwinControllerConfig,
        address: tuple[str, int],
        ask: Callable[[str], bool],
        comes: float = COMES_S,
        stays: float = STAYS_S,
    ) -> None:
        self._stoppable = address[0] in robot.stopping.tried.values()
        # Levels as they are on the wire: what they tell of the allocation is to be found out.
        full = msgspec.structs.replace(robot.stopping, uop="full", tried={})
        self._robot = msgspec.structs.replace(robot, stopping=full)
        self._layout, self._config, self._address = layout, config, address
        self._ask, self._comes, self._stays_s = ask, comes, stays
        self.results: list[Result] = []
        self.outputs: frozenset[str] = frozenset()
        self._changed = threading.Condition()
        self._looks: deque[Look] = deque(maxlen=REMEMBERED)
        self._state, self._alarm = ProgramState.ABORTED, ""
        self._sample: RobotSample | None = None
        # Of the program, by the link that is open now.
        self._heard = threading.Event()
        self._rests = True  # as far as was seen
        # HOLD was taken away, and it is waited for what the robot does.
        self._holding = False
        self._why_silent = SILENT
        self._link = self._connect(heartbeat=True)

    def __enter__(self) -> StopTrials:
        """Connect."""
        self._link.__enter__()
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        """Disconnect; whatever went wrong, HOLD is taken away before.

        The watchdog of a robot that was not seen to stand stays armed, and ends what runs.
        """
        if kind is not None:
            self._link.send(Signal("hold", False))
        self._link.close(disarm=kind is None and self._rests)

    def run(self) -> Iterator[Finding]:
        """Ask for each trial, make it, and yield what came of it.

        What is not expected ends all: HOLD is taken away, and stays away. Where it is away from the
        beginning, or a fault shows, nothing is asked.
        """
        try:
            self._wait(FIRST_S, lambda: self._heard.is_set() and self._sample is not None)
            if why := self._barred():
                advice = "let it go at its pendant, or RESET on the page; then ask again"
                yield wrong(Group.LINKS, f"nothing is tried: {why}", advice)
                return
            for trial in Trial:
                result = self._try(trial)
                self.results.append(result)
                yield result.finding()
        except (UnexpectedError, LinkLostError, KeyboardInterrupt) as why:
            self._rests = self._holds()
            sent = self._link.connected
            held = "was taken away and stays away" if sent else "may not have been taken away"
            yield wrong(
                Group.LINKS,
                f"ended: {str(why) or 'interrupted'}; HOLD {held}",
                "the robot stands; RESET on the page gives HOLD back"
                if self._rests
                else "THE ROBOT IS NOT SEEN TO STAND: press its emergency stop",
            )

    def _barred(self) -> str:
        """Return why no program can run, or an empty text."""
        sample = self._sample
        if sample is None:
            return ""
        if "held" in sample.outputs:
            return "HOLD is away, as trials that ended leave it, or it is held at its pendant"
        if heartbeat_lost(sample):
            return HEARTBEAT_LOST
        return (self._alarm or "FAULT is on") if "fault" in sample.outputs else ""

    def _holds(self) -> bool:
        """Take HOLD away, again with each new connection.

        Return whether the robot stands, or comes to stand, and its program does not run on.
        """
        self._holding = True
        self._link.send(Signal("hold", False))
        try:
            # What was seen before says nothing of this stop.
            self._looks.clear()
            # A program that runs on may stand in a WAIT.
            return self._wait(
                PATIENCE_S,
                lambda: self._state is not ProgramState.RUNNING and stands(self._looks),
            )
        finally:
            self._holding = False

    def _try(self, trial: Trial) -> Result:
        """Make one trial, if the person at the robot agrees."""
        leave = partial(Result, trial, TrialEnd.LEFT_OUT)
        starts = any(
            each.trial is Trial.START and each.outcome is TrialEnd.WORKED for each in self.results
        )
        if trial is Trial.START and self._state is not ProgramState.PAUSED:
            return leave("no program is paused")
        stopped = any(
            each.trial in MEANS and each.outcome is TrialEnd.WORKED for each in self.results
        )
        # Who cannot be stopped by what is known to work is not moved either.
        if trial in (Trial.START, Trial.RSR) and not (stopped or self._stoppable):
            return leave("nothing was seen to stop this robot yet")
        if trial not in (Trial.RSR, Trial.START):
            # Before the question: who reads it may start a program at once.
            self._link.send(Number("override", SLOWEST_PERCENT))
        if not self._ask(question(trial, self._state, starts)):
            return leave("the answer was no")
        if trial is Trial.RSR:
            return self._try_rsr()
        if trial is Trial.START:
            return self._try_start()
        pulsed = self._state is ProgramState.PAUSED and starts
        if pulsed:
            self._link.send(Pulse("start"))
        if not self._wait(self._comes, self._runs):
            if pulsed:
                self._pause_again()
            least = f"{MOVES / WINDOW_S:g} deg/s or mm/s"
            what = f"no program moved a joint by {least} or more within {self._comes:g} s"
            # No output of a simple panel shows HOLD.
            perhaps = "perhaps none was started, or HOLD is away"
            return leave(f"{what}: {perhaps}; else give its motions more percent")
        # So how late it brakes can be measured; it is stopped all the same.
        self._wait(FIRST_S, lambda: evenly(self._looks))
        return self._try_stop(trial)

    def _try_stop(self, trial: Trial) -> Result:
        """Stop the moving robot by one means; where that does not stop it, by HOLD."""
        sent = time.monotonic()
        if trial is Trial.WATCHDOG:
            self._connect_anew(heartbeat=False)
        else:
            self._link.send(*_ACTS[trial])
        self._wait(PATIENCE_S, lambda: stands([look for look in self._looks if look.at >= sent]))
        # Looked at for longer: a stop that is followed by a motion was none.
        self._wait(self._stays_s, lambda: False)
        with self._changed:
            # A copy, for the link's thread goes on to append.
            result = judge_stop(trial, list(self._looks), sent)
        if result.outcome is TrialEnd.FAILED:
            # All other trials fall back on HOLD.
            if trial is Trial.HOLD:
                self.results.append(result)
                raise UnexpectedError(result.what)
            self._hold(result.what)
        if trial is Trial.WATCHDOG:
            self._connect_anew(heartbeat=True)
        self._link.send(*_GIVES_BACK)
        if trial in (Trial.IMSTP, Trial.WATCHDOG):
            self._link.send(Pulse("fault_reset"))  # on a simple panel it is CSTOPI too
            # The drives take up to 2 s, and nothing can be started before.
            if not self._wait(self._config.reset.timeout_ms * 1e-3, lambda: not self._alarm):
                raise UnexpectedError(f"its alarm stays after RESET: {self._alarm}")
        self._stays("it was released")
        return result

    def _try_start(self) -> Result:
        """Let the paused program go on, and pause it again."""
        self._link.send(Pulse("start"))
        moved = self._wait(FIRST_S, self._runs)
        went_on = self._state is ProgramState.RUNNING
        self._pause_again()
        if moved:
            return Result(Trial.START, TrialEnd.WORKED, "START lets a paused program go on")
        if went_on:
            what = f"START lets the program go on, but no joint moved within {FIRST_S:g} s"
            return Result(Trial.START, TrialEnd.LEFT_OUT, what)
        what = "START does not let a paused program go on"
        return Result(Trial.START, TrialEnd.FAILED, what)

    def _pause_again(self) -> None:
        """Hold what START let go on, also what does not move yet; give HOLD back: it is paused."""
        self._hold("START let the program go on")
        self._link.send(Signal("hold", True))
        self._stays("HOLD was given back")

    def _try_rsr(self) -> Result:
        """Let RSR1 start the stream program, and send one joint away and back."""
        if not self._wait(FIRST_S, lambda: self._state is ProgramState.ABORTED):
            return Result(Trial.RSR, TrialEnd.LEFT_OUT, "a program is not ended")
        # One link alone: the other one's heartbeats would be a stranger's.
        self._link.close()
        try:
            with Mover(self._robot, self._layout, self._config, *self._address) as mover:
                reason, way = mover.try_stream()
        finally:
            self._connect_anew(heartbeat=True)
        if not mover.rests or self._state is ProgramState.RUNNING:
            raise UnexpectedError("the robot is not seen to stand after its stream program")
        if reason:
            return Result(Trial.RSR, TrialEnd.FAILED, f"RSR1: {reason}")
        what = f"RSR1 starts the stream program; a joint went {way:.2f} away and back"
        return Result(Trial.RSR, TrialEnd.WORKED, what)

    def _runs(self) -> bool:
        """Return whether a program moves the robot."""
        return self._state is ProgramState.RUNNING and moves(self._looks)

    def _hold(self, why: str) -> None:
        """Stop the robot by what was seen to stop it."""
        if not self._holds():
            raise UnexpectedError(f"{why}, and HOLD did not stop it")

    def _stays(self, after: str) -> None:
        """Look on for a while: a robot that stands must not move by itself."""
        self._looks.clear()
        if self._wait(self._stays_s, lambda: moves(self._looks)):
            raise UnexpectedError(f"the robot moved when {after}")

    def _wait(self, seconds: float, done: Callable[[], bool]) -> bool:
        """Wait until something is so; return whether it is.

        Raises:
            UnexpectedError: The robot is silent, or too fast. Not while HOLD is taken away: it may
                yet hear of that, or brake.
        """
        begun = time.monotonic()
        with self._changed:
            while time.monotonic() < begun + seconds:
                if done():
                    return True
                heard = max(self._looks[-1].at if self._looks else begun, begun)
                came = self._changed.wait(SILENT_S)
                if self._holding:
                    continue
                if not came and time.monotonic() > heard + 2.0 * SILENT_S:
                    raise UnexpectedError(self._why_silent)
                if fast := too_fast(self._looks, self._robot):
                    raise UnexpectedError(fast)
            # Here too: the link's thread appends to what it walks through.
            return done()

    def _connect_anew(self, heartbeat: bool) -> None:
        """Let another link take over, as if nobody had said farewell."""
        self._link.close(disarm=False)
        # What the other link told last may be long ago.
        self._heard.clear()
        self._why_silent = SILENT
        self._link = self._connect(heartbeat)
        self._link.__enter__()
        if not self._wait(FIRST_S, self._heard.is_set):
            raise UnexpectedError(self._why_silent)

    def _connect(self, heartbeat: bool) -> ModbusLink:
        """Return a link that is not open yet."""
        line = self._robot, self._layout, self._config, self._address
        hears = self._take, self._told, self._link_changed
        return link_to(*line, *hears, status_period=0.1, heartbeat=heartbeat)

    def _link_changed(self, up: bool, why: str) -> None:
        self._why_silent = SILENT if up else why
        if up and self._holding:
            # What was left while there was no link is dropped.
            self._link.send(Signal("hold", False))

    def _take(self, sample: RobotSample, sent: float, received: float) -> None:
        joints = zip(sample.motion.q, self._robot.joints)
        places = tuple([q / joint.scale for q, joint in joints if joint.twin])
        with self._changed:
            if self._state is not ProgramState.ABORTED:
                self.outputs |= sample.outputs
            self._looks.append(Look(received, places, self._state))
            self._sample = sample
            self._changed.notify()

    def _told(self, program: ProgramStatus, alarm: AlarmStatus) -> None:
        self._state = program.state
        faulted = self._sample is None or is_faulted(self._sample)
        self._alarm = alarm_text(alarm) if is_stopping(alarm, faulted) else ""
        self._heard.set()
