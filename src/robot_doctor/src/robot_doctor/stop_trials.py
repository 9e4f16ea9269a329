"""What of trying a robot's means of stopping is no wire: what was seen, and what follows from it.

A means has stopped the robot only if it moved before, stands within ``PATIENCE_S``, and its program
does not run on. What did not stop it is named so, and no profile will say otherwise.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from enum import Enum
from typing import Any

import msgspec
import numpy as np
from scara_config import Robot
from scara_config.set_up.settings import setting
from scara_config.stopping import ALLOCATED, Means, Stopping
from scara_config.writer import DROPPED, Key, Noted
from twin_controller.robot_sample import ProgramState

from robot_doctor.finding import Finding, Group, fine, note, wrong

SPEED = 5.0
"""At which each means is tried [deg/s or mm/s]; our choice."""
TOO_FAST = {"deg": 10.0, "mm": 50.0}
"""Above it the trial ends [deg/s, mm/s]; our choice."""
WINDOW_S, MOVES, STILL = 0.3, 0.3, 0.1
"""So far at least a joint goes in a window where it moves, at most where it stands [deg or mm]."""
PATIENCE_S = 2.0
"""At ``SPEED`` a robot needs far less to stand; our choice."""
EVEN = 0.1
"""By so much of its speed the fastest joint may differ between the halves of a window, if how long
it goes on is to be measured; our choice."""
LEAST_LOOKS = 6
LATEST_S = 0.45
"""No zone can be kept from a robot that brakes later: robot.yaml allows no more."""
SPREAD_MS, STEP_MS = 30, 10
"""A stop is decided on a reading up to two periods of reading and one of the robot older than the
one that was measured from; written in whole steps, rounded up. With it no zone was entered on
either plant of fanuc_sr6ia: virtual_time/test_zones.py."""
UNMEASURED_MS = 1e3 * LATEST_S + SPREAD_MS
"""What is written of a robot whose delay nobody measured: the longest that could have been."""


class Trial(Enum):
    """What is tried, in this order: what stops the robot comes before what moves it."""

    HOLD = "HOLD"
    START = "START"
    CSTOPI = "CSTOPI"
    IMSTP = "*IMSTP"
    WATCHDOG = "the watchdog"
    RSR = "RSR1"


MEANS: Mapping[Trial, Means] = {
    Trial.HOLD: "hold",
    Trial.CSTOPI: "cstopi",
    Trial.IMSTP: "imstp",
}
"""Those that a profile names."""
_DOES = {
    Trial.HOLD: "HOLD is taken away",
    Trial.START: "START lets the paused program go on; HOLD pauses it again",
    Trial.CSTOPI: "CSTOPI is pulsed",
    Trial.IMSTP: "*IMSTP is switched off: the drives go off",
    Trial.WATCHDOG: "The heartbeat ends: the robot must stop itself",
    Trial.RSR: f"RSR1 starts the stream program, one joint goes {SPEED:g} away and back",
}

_DECIDES = {
    Trial.HOLD: "uop",
    Trial.START: "remote",
    Trial.CSTOPI: "cstopi_for_abort",
    Trial.IMSTP: "imstp_assigned",
    Trial.WATCHDOG: "programs",
    Trial.RSR: "rsr",
}
"""What on the robot's screens decides whether it works."""
_BY_WHOM = "(AUTO: by your PLC; T1: at the pendant)"
"""In AUTO and Remote no key of the pendant starts a program. Source: B-83284EN/09, 5.2.2."""


class TrialEnd(Enum):
    """What came of a trial."""

    WORKED = "worked"
    FAILED = "failed"
    LEFT_OUT = "not tried"


class Result(msgspec.Struct, frozen=True):
    """What came of one trial, in words, and how long the robot went on before it braked [s]."""

    trial: Trial
    outcome: TrialEnd
    what: str
    # None: not measured.
    delay: float | None = None

    def finding(self) -> Finding:
        """Return it as the doctor tells it."""
        if self.outcome is TrialEnd.WORKED:
            return fine(Group.LINKS, self.what)
        if self.outcome is TrialEnd.LEFT_OUT:
            return note(Group.LINKS, f"{self.trial.value}: not tried: {self.what}", "ask again")
        return wrong(Group.LINKS, self.what, setting(_DECIDES[self.trial]).advice)


class Look(msgspec.Struct, frozen=True):
    """One reading: when [s], the twin's joints [deg or mm], what the program does."""

    at: float
    places: tuple[float, ...]
    state: ProgramState


def moves(looks: Sequence[Look]) -> bool:
    """Return whether a joint moves at the newest look."""
    return max(_ways(looks), default=0.0) >= MOVES


def stands(looks: Sequence[Look]) -> bool:
    """Return whether all joints have stood for a window at the newest look."""
    whole = bool(looks) and looks[-1].at - looks[0].at >= WINDOW_S
    return whole and max(_ways(looks), default=0.0) <= STILL


def evenly(looks: Sequence[Look]) -> bool:
    """Return whether the fastest joint moves at the same speed in both halves of the window."""
    newest = _newest(looks)
    if len(newest) < LEAST_LOOKS or not moves(looks):
        return False
    middle = len(newest) // 2
    first, second = _speeds(newest[:middle]), _speeds(newest[middle:])
    joint = int(np.argmax(np.abs(second)))
    return abs(first[joint] - second[joint]) <= EVEN * abs(second[joint])


def too_fast(looks: Sequence[Look], robot: Robot) -> str:
    """Name a joint that is faster than it may be while something is tried; empty: none is."""
    for joint, way in zip(robot.twin_joints, _ways(looks)):
        if way / WINDOW_S > TOO_FAST[joint.unit]:
            return f"{joint.name} moves at {way / WINDOW_S:.0f} {joint.unit}/s"
    return ""


def judge_stop(trial: Trial, looks: Sequence[Look], sent: float) -> Result:
    """Return whether a means has stopped the robot.

    Args:
        trial: What was tried while the robot moved.
        looks: A window before, and from then on until it stood or ``PATIENCE_S`` were over.
        sent: When it was sent [s].
    """
    name, after = trial.value, [look for look in looks if look.at >= sent]
    state = after[-1].state.name.lower() if after else "not told"
    if not stands(after):
        what = f"{name} did not stop the robot within {PATIENCE_S:g} s; its program is {state}"
        return Result(trial, TrialEnd.FAILED, what)
    if after[-1].state is ProgramState.RUNNING:
        what = f"{name} did not stop the robot: it stands, but its program runs on"
        return Result(trial, TrialEnd.FAILED, what)
    end = after[-1].places
    # The last look at which it was not yet where it came to stand.
    last = max((look.at for look in after if _apart(look.places, end) > STILL), default=sent)
    way, within = _apart(after[0].places, end), 0.1 * math.ceil(10.0 * (last - sent) + 0.5)
    what = f"{name} stopped the robot within {within:.1f} s and {way:.2f} deg or mm; {state}"
    before = [look for look in looks if look.at <= sent]
    if not evenly(before):
        return Result(trial, TrialEnd.WORKED, f"{what}; how late is not known: it moved unevenly")
    # So slow a robot brakes within a hair: its way since the newest look is its speed times the
    # delay, whatever its filters do.
    speeds = _speeds(_newest(before))
    joint = int(np.argmax(np.abs(speeds)))
    delay = (end[joint] - before[-1].places[joint]) / speeds[joint]
    if delay > LATEST_S:
        what = f"{name} stopped the robot {delay:.2f} s late, at most {LATEST_S:g} s are allowed"
        return Result(trial, TrialEnd.FAILED, what)
    return Result(trial, TrialEnd.WORKED, f"{what}, {1e3 * delay:.0f} ms late", delay)


def _speeds(looks: Sequence[Look]) -> list[float]:
    """Return the joints' speeds by least squares [deg/s or mm/s]."""
    times = np.array([look.at for look in looks])
    places = np.array([look.places for look in looks])
    speeds: list[float] = np.polyfit(times - times[0], places, 1)[0].tolist()
    return speeds


def question(trial: Trial, state: ProgramState, starts: bool) -> str:
    """Return what is asked before a trial.

    Args:
        trial: What is tried next.
        state: Of the robot's program.
        starts: START was seen to let a paused program go on.
    """
    if trial is Trial.START:
        first = ""
    elif trial is Trial.RSR:
        first = "" if state is ProgramState.ABORTED else "End the program at the pendant (ABORT). "
    elif state is ProgramState.ABORTED:
        # A program of fewer percent would not count as one that moves.
        first = f"Start a program {_BY_WHOM} that moves by J P[n] 100%: the override is 1 %. "
    elif state is ProgramState.PAUSED and not starts:
        first = f"Let the program go on {_BY_WHOM}, by START. "
    else:
        first = "START lets the program go on. " * (state is ProgramState.PAUSED)
    number = list(Trial).index(trial) + 1
    return f"{number} of {len(Trial)}  {first}{_DOES[trial]}. Try it?"


def allocation(seen: frozenset[str], results: Sequence[Result], filed: str) -> str:
    """Return which allocation of the user operator panel was seen.

    Args:
        seen: Names of all outputs that were on while a program ran or was paused.
        results: Of the trials.
        filed: What the profile says.
    """
    # A simple panel has none of these four.
    if seen & {"progrun", "paused", "held", "sysrdy"}:
        return "full"
    if seen & {"cmdenbl", "fault", "batalm", "busy"}:
        return "simple"
    failed = any(each.trial is Trial.HOLD and each.outcome is TrialEnd.FAILED for each in results)
    return "none" if failed else filed


def proposal(stopping: Stopping, address: str, results: Sequence[Result], uop: str) -> Stopping:
    """Return what the profile should say after the trials.

    Of what was tried at other addresses nothing stays: another address is another robot. Nor does
    its delay.
    """
    came = {MEANS[each.trial]: each.outcome for each in results if each.trial in MEANS}
    kept = {means for means, place in stopping.tried.items() if place == address}
    proven = {means for means, outcome in came.items() if outcome is TrialEnd.WORKED}
    proven |= {means for means in kept if came.get(means) in (None, TrialEnd.LEFT_OUT)}
    tried = {means: address for means in ALLOCATED[uop] if means in proven}
    late = {
        MEANS[each.trial]: each.delay
        for each in results
        if each.trial in MEANS and each.delay is not None
    }
    steps = [math.ceil((1e3 * max(0.0, each) + SPREAD_MS) / STEP_MS) for each in late.values()]
    delays = [1.0 * STEP_MS * each for each in steps]
    # The one that is filed is the longest of all that were measured then.
    if not late or (kept - late.keys()) & tried.keys():
        delays.append(stopping.braking_delay_ms if kept or not tried else UNMEASURED_MS)
    said = {"uop": uop, "tried": tried, "braking_delay_ms": max(delays)}
    return msgspec.convert(said, Stopping)


def changes(robot: Stopping, address: str, found: Stopping, date: str) -> dict[Key, Any]:
    """Return what of robot.yaml is to be written, comments included.

    Args:
        robot: What it says.
        address: Of the robot.
        found: What it should say.
        date: Of the trials.
    """
    tried = ("stopping", "tried")
    if not found.tried:
        return {("stopping", "uop"): found.uop, tried: {}}
    said = Noted(address, f"[chk] {date}, seen by doctor --stops")
    written: dict[Key, Any] = {("stopping", "uop"): found.uop}
    if found.braking_delay_ms != robot.braking_delay_ms:
        seen = f"[chk] {date}, measured by doctor --stops"
        if found.braking_delay_ms == UNMEASURED_MS:
            seen = f"[asm] {date}, not measured by doctor --stops: the longest"
        late = Noted(found.braking_delay_ms, seen)
        written["stopping", "braking_delay_ms"] = late
    # Also those that the file names and that hold no longer: they are taken out of it.
    for means in {**robot.tried, **found.tried}:
        written[(*tried, means)] = said if means in found.tried else DROPPED
    return written


def _ways(looks: Sequence[Look]) -> list[float]:
    """Return how far each joint went within the newest window [deg or mm]."""
    newest = [look.places for look in _newest(looks)]
    return [max(places) - min(places) for places in zip(*newest)]


def _newest(looks: Sequence[Look]) -> list[Look]:
    return [look for look in looks if look.at >= looks[-1].at - WINDOW_S]


def _apart(one: Sequence[float], other: Sequence[float]) -> float:
    return max(abs(a - b) for a, b in zip(one, other))
