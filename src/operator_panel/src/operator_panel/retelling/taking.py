"""What a message says becomes part of the page's snapshot; pure.

A message is one of rospy or one that was read from a bag: both have the fields of its definition.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import msgspec
from scara_ros.names import part_name

from operator_panel.view.snapshot import (
    RECENT_S,
    CellState,
    DecisionLine,
    Diagnosis,
    Link,
    Loop,
    Made,
    Part,
    RobotPackage,
    RobotStatus,
    Sighting,
    Snapshot,
)
from scara_msgs.msg import TwinControllerState as Mode

DECISIONS_KEPT = 30
CLOCK = "%H:%M:%S"
TOOLS = ("real_tool", "twin_tool")
ENDED = (Mode.PAUSED, Mode.STOPPED, Mode.STANDSTILL, Mode.ESTOP, Mode.FAULT, Mode.OFFLINE)
"""What was asked for before one of these modes began does not begin in it, nor after it."""
PERSON_DIGITS = 2  # our choice: a centimetre
PLACE_DIGITS = 4  # our choice: a tenth of a millimetre, so that what rests is not sent again


def with_state(snapshot: Snapshot, message: Any, now: float, clock: str) -> Snapshot:
    """Take a TwinControllerState that came at ``now`` [s], by the time of day ``clock``."""
    links = tuple(Link(**_fields(link, Link)) for link in message.links)
    fields = _fields(message, CellState, "links", *TOOLS)
    if hasattr(message, "real_tool"):
        for name in TOOLS:
            point = getattr(message, name)
            fields[name] = (point.x, point.y, point.z)
    else:
        # Of a recording from before both sides were told at one instant: another distance.
        fields.pop("deviation_mm", None)
    state = CellState(links=links, **fields)
    apart = tuple(one for one in snapshot.apart if now - one[0] <= RECENT_S)
    if state.leader and math.isfinite(state.deviation_mm):
        apart = (*apart, (now, state.deviation_mm))
    before, ended = snapshot.state, snapshot.ended
    if before is not None and before.mode != state.mode and state.mode in ENDED:
        ended = now
    return msgspec.structs.replace(
        snapshot, state=state, received=now, ended=ended, silent_since=clock, apart=apart
    )


def with_decision(snapshot: Snapshot, message: Any, time: str) -> Snapshot:
    """Take a Decision made at ``time``, date and time of day."""
    by = f" [by {message.who}]" if message.who else ""
    line = DecisionLine(time, message.mode_before, message.mode_after, message.why + by)
    decisions = (line, *snapshot.decisions)[:DECISIONS_KEPT]
    return msgspec.structs.replace(snapshot, decisions=decisions)


def with_package(snapshot: Snapshot, message: Any) -> Snapshot:
    """Take a RobotData."""
    package = RobotPackage(**_fields(message, RobotPackage))
    return msgspec.structs.replace(snapshot, package=package)


def with_loop(snapshot: Snapshot, joint: str, message: Any, now: float) -> Snapshot:
    """Take a JointControllerState of a joint that came at ``now`` [s]."""
    loop = Loop(message.set_point, message.process_value, message.error, message.command, now)
    return msgspec.structs.replace(snapshot, loops={**snapshot.loops, joint: loop})


def with_joint_states(snapshot: Snapshot, message: Any, now: float) -> Snapshot:
    """Take a JointState of the twin at ``now`` [s]: what its loops measure, and their efforts.

    Set points and errors are not in it.
    """
    rows = zip(message.name, message.position, message.effort, strict=False)
    loops = {
        name: Loop(math.nan, float(position), math.nan, float(effort), now)
        for name, position, effort in rows
    }
    return msgspec.structs.replace(snapshot, loops={**snapshot.loops, **loops})


def with_parts(snapshot: Snapshot, side: str, message: Any) -> Snapshot:
    """Take a MarkerArray of a side's parts; the same snapshot if none has moved."""
    parts = tuple(
        _part(marker)
        for marker in message.markers
        if marker.type == marker.CYLINDER and marker.action == marker.ADD
    )
    if snapshot.parts.get(side) == parts:
        return snapshot
    return msgspec.structs.replace(snapshot, parts={**snapshot.parts, side: parts})


def with_person(snapshot: Snapshot, sensor: str, message: Any, now: float) -> Snapshot:
    """Take a PointStamped of a person that ``sensor`` saw; the same if it is no place."""
    place = (message.point.x, message.point.y, message.point.z)
    if not all(map(math.isfinite, place)):
        return snapshot
    rounded = tuple(round(value, PERSON_DIGITS) for value in place)
    people = {**snapshot.people, sensor: Sighting(rounded, now)}
    return msgspec.structs.replace(snapshot, people=people)


def with_status(snapshot: Snapshot, message: Any) -> Snapshot:
    """Take a RobotStatus of ROS-Industrial."""
    return msgspec.structs.replace(snapshot, status=RobotStatus(**_fields(message, RobotStatus)))


def with_part_event(snapshot: Snapshot, side: str, message: Any) -> Snapshot:
    """Take a PartEvent: a part that was placed counts."""
    if message.kind != message.PLACED:
        return snapshot
    placed: Mapping[str, int] = {**snapshot.placed, side: snapshot.placed.get(side, 0) + 1}
    return msgspec.structs.replace(snapshot, placed=placed)


def with_outcome(snapshot: Snapshot, message: Any) -> Snapshot:
    """Take a MotionOutcome."""
    return msgspec.structs.replace(snapshot, made=Made(**_fields(message, Made)))


def with_diagnostics(snapshot: Snapshot, message: Any, now: float) -> Snapshot:
    """Take a DiagnosticArray that came at ``now`` [s]."""
    found = {
        status.name: Diagnosis(
            int(status.level),
            status.name,
            status.message,
            now,
            {value.key: value.value for value in status.values},
        )
        for status in message.status
    }
    return msgspec.structs.replace(snapshot, diagnoses={**snapshot.diagnoses, **found})


def _fields(message: Any, kind: type[msgspec.Struct], *without: str) -> dict[str, Any]:
    """Return the fields of a message that ``kind`` has too; lists become tuples.

    A recording of an earlier version may lack some.
    """
    found = {}
    for name in kind.__struct_fields__:
        if name not in without and hasattr(message, name):
            value = getattr(message, name)
            # A mode or a yes and no of ROS-Industrial holds one number.
            value = getattr(value, "val", value)
            value = value.tolist() if hasattr(value, "tolist") else value
            found[name] = tuple(value) if isinstance(value, list) else value
    return found


def _part(marker: Any) -> Part:
    place, turn, size = marker.pose.position, marker.pose.orientation, marker.scale
    red, green, blue = (
        round(255 * min(max(part, 0.0), 1.0))
        for part in (marker.color.r, marker.color.g, marker.color.b)
    )
    return Part(
        name=part_name(marker),
        position=(
            round(place.x, PLACE_DIGITS),
            round(place.y, PLACE_DIGITS),
            round(place.z, PLACE_DIGITS),
        ),
        orientation=(round(turn.x, 3), round(turn.y, 3), round(turn.z, 3), round(turn.w, 3)),
        diameter=round(size.x, 5),
        height=round(size.z, 5),
        colour=f"#{red:02x}{green:02x}{blue:02x}",
    )
