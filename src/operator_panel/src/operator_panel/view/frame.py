"""The frame that every open page gets at the update rate: texts, bars, poses, chart points."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import msgspec
import numpy as np
from scara_config import Robot
from scara_ros.names import current_line
from scara_ros.page import page_words

from operator_panel.control.mode_table import next_step
from operator_panel.view import words
from operator_panel.view.judged import gate_text, made_text
from operator_panel.view.robot.status import program_text, status_texts
from operator_panel.view.snapshot import CellState, Loop, Snapshot
from scara_description.urdf import Model, Vector, link_pose

NOTHING = words.UNKNOWN

Points = dict[str, tuple[float | None, ...]]
"""Chart points by joint, and those of the pair; see :class:`Frame`."""
PERSON_S = 1.0
"""A person that nobody has seen for longer is not shown; our choice. The controller counts a silent
sensor as a person at the robot, and the page says so in words."""
TOOL_DIGITS = 6
"""A micrometre: poses and distance agree to the last digit that is shown; our choice."""
WARN_SHARE = 0.7
"""Beyond this share of its limit a distance is coloured as a warning; our choice."""
PAIR = "pair"
"""Whose points are of no joint; none is called so."""


class Quantity(NamedTuple):
    """A quantity of the pair that a chart can show, with the digits that go to the page."""

    title: str
    unit: str
    digits: int
    read: Callable[[CellState], float]


PAIR_QUANTITIES: dict[str, Quantity] = {
    "apart": Quantity("Tools apart", "mm", 4, lambda state: state.deviation_mm),
    "speed": Quantity("Speed", "%", 2, lambda state: state.speed_applied_percent),
    "requested": Quantity("Speed asked for", "%", 2, lambda state: state.speed_requested_percent),
    "lag": Quantity("Lag of the follower", "ms", 3, lambda state: 1e3 * state.lag),
}
"""By their names in an address, in the order of the pair's points."""


class Frame(msgspec.Struct, frozen=True, omit_defaults=True):
    """What changes all the time.

    Attributes:
        t: Time of the chart points: monotonic [s].
        text: What stands at each place of the page.
        tone: CSS class of some places.
        bar: For each joint where real and twin are within the limits, 0..1; empty if unknown.
        pose: For each side the joint positions [rad] or [m].
        point: For each joint real, twin [deg or mm], set point, measured, error [deg or mm],
            effort [N m or N]; for ``PAIR`` its ``PAIR_QUANTITIES``; null if unknown. Both sides
            are those of one instant.
        tool: For each side the tool's position [m].
        gauge: Share of its limit, 0..1, for each gauge.
        mode: As in scara_msgs/TwinControllerState; absent while the controller has said nothing.
        silent: Text: since when the twin controller is silent; absent while it is not.
        people: Where people are [m]: the nearest one of each sensor.
        program: The program of the real robot that runs or is paused, and its line.
        no_stop: Text: why no STOP can be sent from the page, and what to do; absent while it can.
    """

    t: float
    text: dict[str, str]
    tone: dict[str, str]
    bar: dict[str, tuple[float | None, float | None]] = {}
    pose: dict[str, dict[str, float]] = {}
    point: Points = {}
    tool: dict[str, tuple[float, float, float]] = {}
    gauge: dict[str, float] = {}
    mode: str = ""
    silent: str = ""
    no_stop: str = ""
    program: tuple[str, int] = ("", 0)
    people: tuple[Vector, ...] = ()


class FrameMaker:
    """Makes frames for one robot."""

    def __init__(
        self, robot: Robot, model: Model, silent_s: float, alarm_mm: tuple[float, float]
    ) -> None:
        """Remember what does not change.

        Args:
            robot: The joints.
            model: Their places.
            silent_s: The twin controller, or a PID loop, is silent after so long [s].
            alarm_mm: So far apart the tools raise an alarm, while a side leads and at rest.
        """
        self._alarm_mm = alarm_mm
        self._joints = {joint.name: joint for joint in robot.twin_joints}
        self._model = model
        self._tool_link = robot.tool_frame
        self._silent_s = silent_s
        self._home = link_pose(model, robot.tool_frame, {})

    def make(self, snapshot: Snapshot, now: float) -> Frame:
        """Return the frame of ``snapshot`` at the monotonic time ``now`` [s]."""
        state = snapshot.state
        if state is None:
            why = (
                "Waiting for the twin controller."
                if snapshot.master
                else "No ROS master answers. Trying again each second."
            )
            return Frame(
                t=now,
                text={"mode": "No data", "why": why},
                tone={"mode": "bad"},
                silent=why,
                no_stop=words.no_stop_text(snapshot.no_stop),
            )
        silent = (
            f"The twin controller is silent since {snapshot.silent_since}."
            if self._is_silent(snapshot, now)
            else ""
        )
        poses = self._poses(state)
        places = {
            side: link_pose(self._model, self._tool_link, pose) for side, pose in poses.items()
        }
        tools = {side: _rounded(place[:3, 3]) for side, place in places.items()}
        if math.isfinite(state.real_tool[0]):
            # At the same instant; the poses may be of two, as when a line is down.
            tools = {"real": _rounded(state.real_tool), "twin": _rounded(state.twin_tool)}
        home = self._home[:3, :3]
        turns = {side: words.turn_text(home, place[:3, :3]) for side, place in places.items()}
        # How far apart at the same instant the tools raise an alarm now.
        leading, resting = self._alarm_mm
        apart, limit = state.deviation_mm, leading if state.leader else resting
        return Frame(
            t=round(now, 3),
            text=self._texts(snapshot, state, tools, limit, now)
            | {f"turn.{side}": turns.get(side, NOTHING) for side in ("real", "twin")},
            tone=_tones(state, limit) | {"gate": gate_text(snapshot, now)[1]},
            bar={name: self._bar(state, name) for name in self._joints},
            pose=poses,
            point=self.points(snapshot, now),
            tool=tools,
            # An unknown distance empties the gauge: what it showed before is not so any more.
            gauge={"deviation": round(min(apart / limit, 1.0), 3) if math.isfinite(apart) else 0.0},
            mode=state.mode,
            silent=silent,
            no_stop=words.no_stop_text(snapshot.no_stop),
            program=current_line(snapshot.package.program) if snapshot.package else ("", 0),
            people=tuple(
                one.place for one in snapshot.people.values() if now - one.seen <= PERSON_S
            ),
        )

    def points(self, snapshot: Snapshot, now: float) -> Points:
        """Return the chart points alone; empty while the twin controller is silent."""
        state = snapshot.state
        if state is None or self._is_silent(snapshot, now):
            return {}
        # A jog opens the position loops, and what they said before it is not of now.
        loops = {
            name: loop
            for name, loop in snapshot.loops.items()
            if now - loop.received <= self._silent_s
        }
        points = {name: self._point(state, loops, name) for name in self._joints}
        points[PAIR] = tuple(
            _finite(one.read(state), one.digits) for one in PAIR_QUANTITIES.values()
        )
        return points

    def _is_silent(self, snapshot: Snapshot, now: float) -> bool:
        return snapshot.is_silent(now, self._silent_s)

    def _texts(
        self,
        snapshot: Snapshot,
        state: CellState,
        tools: dict[str, Vector],
        limit: float,
        now: float,
    ) -> dict[str, str]:
        real, arrow, twin = words.roles(state)
        text = {
            "gate": gate_text(snapshot, now)[0],
            "made": made_text(snapshot),
            "mode": page_words.mode_title(state.mode),
            "why": page_words.people(state.why),
            "lead.real": real,
            "lead.arrow": arrow,
            "lead.twin": twin,
            "motion": words.motion_text(state),
            "next": next_step(state)[0],
            "speed.applied": words.percent(state.speed_applied_percent),
            "speed.reason": words.speed_reason(state),
            "deviation": f"{words.number(state.deviation_mm)} mm",
            "deviation.limit": f"alarm from {limit:g} mm",
            "lag": words.lag_text(state),
            "jog": snapshot.jog,
            "gripper": words.gripper_text(state),
        }
        columns = (
            ("real", state.real_position, False),
            ("twin", state.twin_position, False),
            ("deviation", state.deviation, True),
        )
        for index, name in enumerate(state.name):
            for key, values, signed in columns:
                text[f"{name}.{key}"] = (
                    words.number(values[index], 2, signed) if index < len(values) else NOTHING
                )
        for side in ("real", "twin"):
            text[f"tool.{side}"] = NOTHING
            if side in tools:
                x, y, z = (words.number(value * 1e3, 1) for value in tools[side])
                text[f"tool.{side}"] = f"x {x}  y {y}  z {z} mm"
        for link in state.links:
            text[f"link.{link.name}.state"] = words.link_state(link)
            text[f"link.{link.name}.figures"] = words.link_figures(link)
        switch = snapshot.package.operation_mode if snapshot.package else ""
        return text | _package_texts(snapshot) | status_texts(snapshot.status, switch)

    def _poses(self, state: CellState) -> dict[str, dict[str, float]]:
        """Return joint positions in SI for each side that is known."""
        sides = {"real": state.real_position, "twin": state.twin_position}
        known = [
            (index, self._joints[name])
            for index, name in enumerate(state.name)
            if name in self._joints
        ]
        return {
            side: {joint.name: round(values[index] * joint.scale, 6) for index, joint in known}
            for side, values in sides.items()
            if len(values) == len(state.name)
        }

    def _bar(self, state: CellState, name: str) -> tuple[float | None, float | None]:
        """Return where both sides are between the joint's limits, 0 to 1."""
        joint = self._joints[name]
        lower, upper = joint.lower / joint.scale, joint.upper / joint.scale
        index = state.name.index(name) if name in state.name else None
        places: list[float | None] = []
        for values in (state.real_position, state.twin_position):
            if index is None or index >= len(values):
                places.append(None)
                continue
            share = (values[index] - lower) / (upper - lower)
            places.append(round(min(max(share, 0.0), 1.0), 4))
        return places[0], places[1]

    def _point(
        self, state: CellState, loops: dict[str, Loop], name: str
    ) -> tuple[float | None, ...]:
        index = state.name.index(name) if name in state.name else len(state.name)
        sides = [
            values[index] if index < len(values) else None
            for values in (state.real_position, state.twin_position)
        ]
        loop = loops.get(name)
        if loop is None:
            return (*sides, None, None, None, None)
        scale = self._joints[name].scale
        border = [
            _finite(value / scale, 5) for value in (loop.set_point, loop.process_value, loop.error)
        ]
        return (*sides, *border, _finite(loop.command, 4))


def _rounded(place: Sequence[float] | np.ndarray) -> Vector:
    x, y, z = (round(float(value), TOOL_DIGITS) for value in place)
    return x, y, z


def _package_texts(snapshot: Snapshot) -> dict[str, str]:
    package = snapshot.package
    if package is None:
        return {"robot.program": NOTHING, "robot.speed": NOTHING, "robot.ready": NOTHING}
    return {
        "robot.program": program_text(package),
        "robot.speed": words.percent(package.speed_percent),
        "robot.ready": "ready" if package.ready else "not ready",
    }


def _tones(state: CellState, limit: float) -> dict[str, str]:
    # The tone of the tools' distance is that of the limit beside it.
    apart = "warn" if state.deviation_mm > WARN_SHARE * limit else "good"
    if state.diverged or state.deviation_mm > limit:
        apart = "bad"
    elif not math.isfinite(state.deviation_mm):
        apart = ""
    tone = {
        "mode": page_words.mode_tone(state.mode),
        "lead": state.leader or "nobody",
        "speed.applied": "warn" if state.speed_limited else "",
        "deviation": apart,
        "next": next_step(state)[1],
    }
    for link in state.links:
        tone[f"link.{link.name}.state"] = "good" if words.link_state(link) == "connected" else "bad"
    return tone


def _finite(value: float, decimals: int) -> float | None:
    return round(value, decimals) if math.isfinite(value) else None
