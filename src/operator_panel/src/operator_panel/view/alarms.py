"""What is wrong now, and what to do about it."""

from __future__ import annotations

import re

import msgspec
from scara_ros.diagnosis import Level

from operator_panel.view.snapshot import CellState, Snapshot
from scara_msgs.msg import TwinControllerState

DIAGNOSIS_MEMORY_S = 3.5  # REP-107 asks for 1 Hz; three missed and a half

# (source, mode and text): what an operator does. The first row that fits is taken; both are
# searched, not matched. What a remedy names has to work in that mode.
REMEDIES: tuple[tuple[str, str, str], ...] = (
    (
        "link real",
        r"",
        "Is the robot's controller on and its Modbus server reachable? It reconnects by itself.",
    ),
    ("link twin", r"", "Do gateway and simulator run? It reconnects by itself."),
    (
        "real robot",
        r"^\w* ?WARN\b",
        "The robot works on. Press RESET on its own pendant once it was read.",
    ),
    (
        "real robot",
        r"^OFFLINE",
        "Clear the cause on the robot's own pendant; RESET works here once both links are up.",
    ),
    (
        "real robot",
        r"heartbeat",
        "The robot stopped itself because the line to it was quiet. RESET, then ALIGN.",
    ),
    ("real robot", r"", "Clear the cause on the robot's own pendant, then RESET, then ALIGN."),
    ("leading", r"", "Until then the twin shows what the robot does, and moves nothing."),
    ("pair", r"^(STOPPED|IDLE)\b", "Look at both robots, then ALIGN."),
    ("pair", r"^(ESTOP|FAULT|STANDSTILL)\b", "Look at both robots, RESET, then ALIGN."),
    ("pair", r"_LEADS\b", "Look at both robots, STOP, then ALIGN."),
    (
        "pair",
        r"^OFFLINE",
        "Look at both robots; with both links up the pair aligns by itself, or stays stopped.",
    ),
    (
        "pair",
        r"",
        "Look at both robots, ACKNOWLEDGE, then RESUME; if they part again, STOP and ALIGN.",
    ),
    (
        "twin_controller",
        r"^OFFLINE",
        "Check that both links are up; a pair that was not stopped aligns by itself then.",
    ),
    ("twin_controller", r"^(ESTOP|FAULT)\b", "Remove the cause, RESET, then ALIGN."),
    ("recorder", r"disk|space|free", "Make room on the disk, then start a new recording."),
    ("recorder", r"", "Stop the recording and start a new one; the bag so far stays readable."),
    ("what_if: predictions", r"", "The text says what to look at; previews are off by as much."),
    ("health_watch", r"likely", "The text says where to look; the robot works on meanwhile."),
    ("health_watch", r"", "Wear is not watched meanwhile; the robot works on."),
    ("gateway", r"", "Look into the gateway's log; its clients reconnect by themselves."),
    (
        "simulator",
        r"too slow|stalls",
        "The machine is overloaded: end other programs. The twin may lag meanwhile.",
    ),
    ("simulator", r"refused", "A command to the simulator was wrong: its log says which and why."),
    (
        "simulator",
        r"effort limit|inside its limits",
        "The twin cannot follow so fast: a lower speed cap helps.",
    ),
)
ELSE = "Look into the log of this node."


class Alarm(msgspec.Struct, frozen=True):
    """One line of the alarm list. ``level`` is warn or error."""

    level: str
    source: str
    text: str
    remedy: str


def remedy(source: str, text: str) -> str:
    """Return what to do about a message.

    Args:
        source: Who says it.
        text: The controller's mode, a space, and the message.
    """
    for where, what, advice in REMEDIES:
        if where in source and re.search(what, text):
            return advice
    return ELSE


def active_alarms(snapshot: Snapshot, now: float, silent_s: float) -> tuple[Alarm, ...]:
    """Return what is wrong, worst first.

    The controller's own alarm comes first, then the diagnostics not older than seconds.

    Args:
        snapshot: What is known.
        now: Monotonic time [s].
        silent_s: From when on the twin controller counts as silent.
    """
    if not snapshot.master:
        return (
            Alarm(
                "error",
                "ROS master",
                "No ROS master answers.",
                "Start the cell; this page connects by itself.",
            ),
        )
    found: list[Alarm] = []
    if snapshot.is_silent(now, silent_s):
        text = (
            f"Silent since {snapshot.silent_since}."
            if snapshot.silent_since
            else "Not heard of yet."
        )
        found.append(
            Alarm(
                "error",
                "twin controller",
                text,
                "Is the node running? This page goes on by itself.",
            )
        )
    elif snapshot.state is not None and snapshot.state.alarm:
        found.append(_own(snapshot.state))
    # The mode stands in the bar, and what its diagnosis tells is in the state.
    wrong = (
        d
        for d in snapshot.diagnoses.values()
        if d.level != Level.OK and not d.name.endswith("twin_controller: mode")
    )
    mode = snapshot.state.mode if snapshot.state is not None else ""
    recent = (d for d in wrong if now - d.received < DIAGNOSIS_MEMORY_S)
    for diagnosis in sorted(recent, key=lambda d: (-d.level, d.name)):
        source = diagnosis.name.lstrip("/")
        level = "warn" if diagnosis.level == Level.WARN else "error"
        advice = remedy(source, f"{mode} {diagnosis.message}")
        shown = (
            source.removeprefix("twin_controller: ")
            if "real robot" in source or "link" in source
            else source
        )
        alarm = Alarm(
            level, shown.replace("twin_controller", "twin controller"), diagnosis.message, advice
        )
        # One line for one trouble: the one that names its source.
        same = [known for known in found if known.text and known.text in alarm.text]
        if same:
            found[found.index(same[0])] = alarm
        else:
            found.append(alarm)
    return tuple(found)


def _own(state: CellState) -> Alarm:
    """Return the controller's alarm; most of its texts say already what to do."""
    level = (
        "warn"
        if state.mode in (TwinControllerState.PAUSED, TwinControllerState.STOPPED)
        else "error"
    )
    said = any(command in state.alarm for command in ("RESET", "ACKNOWLEDGE", "ALIGN"))
    advice = "" if said else remedy("twin_controller", f"{state.mode} {state.alarm}")
    return Alarm(level, "twin controller", state.alarm, advice)
