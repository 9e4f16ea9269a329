"""Leaders, numbers and links in words, as an operator reads them."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from scara_config.robot import LEAD_IS_FALSE

from operator_panel.view.snapshot import CellState, Link
from scara_msgs.msg import TwinControllerState as Mode

MINUS = "\N{MINUS SIGN}"
UNKNOWN = "\N{EN DASH}"
LEVEL_DEG = 0.005  # our choice: less is shown as 0.00

SIDES = {"real": "real robot", "twin": "twin"}
COMMANDS = {"ESTOP": "Emergency stop", "SPEED": "Speed cap", "MOVE": "Move"}
# leader: what the real robot does, the arrow between both, what the twin does.
ROLES: dict[str, tuple[str, str, str]] = {
    "real": ("leads", "\N{RIGHTWARDS ARROW}", "follows"),
    "twin": ("follows", "\N{LEFTWARDS ARROW}", "leads"),
    "operator": ("obeys", "\N{LEFT RIGHT ARROW}", "obeys"),
    "": ("waits", "\N{MIDDLE DOT}", "waits"),
}


def number(value: float, decimals: int = 2, signed: bool = False) -> str:
    """Return a number with a true minus sign; what is not finite is shown as a dash.

    Args:
        value: The number.
        decimals: Digits after the point.
        signed: Show a plus sign too; a rounded zero has none.
    """
    if not math.isfinite(value):
        return UNKNOWN
    text = f"{value:.{decimals}f}"
    # What rounds to zero has no side, and a minus in front of it would suggest one.
    if float(text) == 0.0:
        text = text.removeprefix("-")
    elif signed and value > 0.0:
        text = f"+{text}"
    return text.replace("-", MINUS)


def percent(value: float) -> str:
    """Return a whole percentage."""
    return f"{number(value, 0)} %"


def seconds(value: float) -> str:
    """Return a time in the unit that reads best; nobody needs less than a millisecond.

    Example:
        >>> seconds(0.0041), seconds(0.0003), seconds(12.3456)
        ('4 ms', 'under 1 ms', '12.3 s')
    """
    if not math.isfinite(value):
        return UNKNOWN
    size = abs(value)
    if size < 0.95e-3:
        return "under 1 ms"
    if size < 0.9995:
        return f"{number(value * 1e3, 0)} ms"
    if size < 600.0:
        return f"{number(value, 1)} s"
    # Rounded before it is parted: no hour has 60 minutes.
    hours, minutes = divmod(round(size / 60.0), 60)
    text = f"{hours} h {minutes} min"
    if hours >= 24:
        days, hours = divmod(round(size / 3600.0), 24)
        text = f"{days} d {hours} h"
    return f"{MINUS}{text}" if value < 0.0 else text


def link_figures(link: Link) -> str:
    """Return how fresh a link's values are, how fast and surely it answers, how good its clock is.

    How far the clock is from ours is left out: a robot's counts from when it was switched on.
    """
    if not link.connected:
        return "no values come"
    parts = [f"values {seconds(link.age)} old"]
    if math.isfinite(link.round_trip):
        parts.append(f"answers in {seconds(link.round_trip)}")
    if math.isfinite(link.clock_uncertainty):
        parts.append(f"clock within {seconds(link.clock_uncertainty)}")
    if link.repeated:
        parts.append(f"{link.repeated} asked again")
    return ", ".join(parts)


def link_state(link: Link) -> str:
    """Return whether a link is up, else why not."""
    if link.connected and not link.reason:
        return "connected"
    return link.reason or "not connected"


def motion_text(state: CellState) -> str:
    """Return which side moves, or which is not heard: that one may do either."""
    positions = {"real": state.real_position, "twin": state.twin_position}
    unheard = [SIDES[side] for side, position in positions.items() if not position]
    if unheard:
        return f"the {unheard[0]} is not heard" if len(unheard) == 1 else "neither is heard"
    real, twin = not state.real_standing_still, not state.twin_standing_still
    if real and twin:
        return "both move"
    if real or twin:
        return f"the {'real robot' if real else 'twin'} moves"
    return "both stand still"


def speed_reason(state: CellState) -> str:
    """Return what speed was asked for, and why the pair does not get it."""
    if not math.isfinite(state.speed_requested_percent):
        return "the robot does not tell its program's speed"
    asked = percent(state.speed_requested_percent)
    if state.only_followed.startswith(LEAD_IS_FALSE):
        return "asked of the twin alone: the robot's pendant sets the robot's speed"
    if not state.speed_limited:
        return "of full speed, as asked for"
    return f"{asked} asked for; lowered: {state.speed_reason or 'limited'}"


def roles(state: CellState) -> tuple[str, str, str]:
    """Return what the real robot does, an arrow towards the follower, what the twin does."""
    if state.mode == Mode.ALIGNING:
        return "waits", "\N{RIGHTWARDS ARROW}", "comes closer"
    if state.mode == Mode.PAUSED and state.only_followed and not state.real_standing_still:
        return "moves on", "\N{MIDDLE DOT}", "is held"
    if state.mode == Mode.PAUSED:
        return "is held", "\N{MIDDLE DOT}", "is held"
    return ROLES.get(state.leader, ROLES[""])


ON_TIME_S = 0.5e-3
"""Less than this is no delay that a person could read; our choice."""


def lag_text(state: CellState) -> str:
    """Return in words who follows and how late.

    Example:
        >>> lag_text(CellState("TWIN_LEADS", leader="twin", lag=0.0124))
        'the real robot is 12 ms behind'
        >>> lag_text(CellState("REAL_LEADS", leader="real", lag=-0.0031))
        'the twin is 3 ms ahead'
        >>> lag_text(CellState("REAL_LEADS", leader="real", lag=0.0002))
        'the twin is on time'
        >>> lag_text(CellState("IDLE"))
        'nobody follows now'
    """
    follower = SIDES["twin" if state.leader == "real" else "real"]
    if not state.leader or not math.isfinite(state.lag):
        return "nobody follows now"
    if abs(state.lag) < ON_TIME_S:
        return f"the {follower} is on time"
    return f"the {follower} is {seconds(abs(state.lag))} {'behind' if state.lag > 0.0 else 'ahead'}"


def gripper_text(state: CellState) -> str:
    """Return what both grippers do.

    Example:
        >>> gripper_text(CellState("IDLE", real_gripper="off", twin_gripper="holding part_1"))
        'real robot: open, twin: holding part_1'
    """
    shown = {"on": "closed", "off": "open", "": "unknown"}
    real, twin = (shown.get(text, text) for text in (state.real_gripper, state.twin_gripper))
    return f"real robot: {real}, twin: {twin}"


WAYS = {"linear": " in a line", "circular": " in an arc"}
FRAME_FIELDS = {"frame": "in user frame", "tool": "for tool frame"}


def command_title(command: str, fields: Mapping[str, object]) -> str:
    """Return a command with what was asked for.

    Example:
        >>> command_title("MOVE", {"x": 0.51, "y": 0.16, "z": 0.1, "speed_percent": 50.0})
        'Move to x 510 y 160 z 100 mm at 50 %'
        >>> command_title("MOVE", {"x": 0.5, "y": 0.0, "z": 0.1, "has_yaw": True, "yaw": -0.5})
        'Move to x 500 y 0 z 100 mm, yaw −28.6 deg'
        >>> command_title("MOVE", {"x": 0.5, "y": 0.0, "z": 0.1, "path": "linear"})
        'Move in a line to x 500 y 0 z 100 mm'
        >>> command_title("ESTOP", {})
        'Emergency stop'
    """
    title = COMMANDS.get(command, command.capitalize())
    title += WAYS.get(str(fields.get("path", "")), "")
    if "x" in fields:
        title += " to " + " ".join(f"{a} {number(1e3 * _float(fields[a]), 0)}" for a in "xyz")
        title += " mm"
    for key, text in FRAME_FIELDS.items():
        if fields.get(key):
            title += f" {text} {fields[key]}"
    if fields.get("has_yaw"):
        title += f", yaw {number(math.degrees(_float(fields['yaw'])), 1)} deg"
    if fields.get("corner_mm"):
        title += ", corners rounded"
    if fields.get("speed_mm_s"):
        title += f", tool {number(_float(fields['speed_mm_s']), 0)} mm/s"
    speed = _float(fields.get("speed_percent", 0.0))
    if command == "SPEED":
        return f"{title} {percent(speed)}"
    return f"{title} at {percent(speed)}" if speed else title


def _float(value: object) -> float:
    return float(value)  # type: ignore[arg-type]


def no_stop_text(why: str) -> str:
    """Return what the page says while no STOP gets through, or an empty text.

    Example:
        >>> no_stop_text("roscore does not answer")
        'STOP does not get through from here: use the stop at the robot. Roscore does not answer.'
    """
    if not why:
        return ""
    reason = why[:1].upper() + why[1:]
    return f"STOP does not get through from here: use the stop at the robot. {reason}."


def turn_text(home: np.ndarray, now: np.ndarray) -> str:
    """Return the turn from ``home`` to ``now`` about fixed axes of the base: x, y, z are W, P, R.

    A tool that only turns about z, as a SCARA's, is told by R alone.

    Args:
        home: Rotation of the tool at home, shape ``(3, 3)``.
        now: Its rotation now.

    Source:
        The names W, P, R and their order: the maker's Cartesian display. From the home pose: our
        choice; a real SR-6iA shows R = J1 + J2 + J4 (tests/golden).
    """
    turned = now @ home.T
    w = math.degrees(math.atan2(turned[2, 1], turned[2, 2]))
    # Rounding can carry the value a little beyond 1, where there is no angle.
    p = math.degrees(math.asin(max(-1.0, min(1.0, -turned[2, 0]))))
    r = number(math.degrees(math.atan2(turned[1, 0], turned[0, 0])), 1)
    if max(abs(w), abs(p)) < LEVEL_DEG:
        return f"R {r} deg"
    return f"W {number(w, 1)}  P {number(p, 1)}  R {r} deg"
