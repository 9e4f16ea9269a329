"""Places of the tool in tab Teach: typed, taken from a robot, or spanned as a grid."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

from nicegui import ui
from scara_config.elbow import elbow_of
from scara_config.programs.files import is_cartesian
from scara_config.programs.tp.listing import Position, Program

from operator_panel.control.fields import parse_number
from operator_panel.page.view_io import PageView, push_button
from operator_panel.teach.draft import TeachError
from operator_panel.teach.grid import MOST_PLACES, Place, grid_of, outer_axes, read_places
from operator_panel.teach.places import (
    joints_of,
    position_of,
    real_at,
    stands_at,
    twin_at,
)

Act = Callable[[], Any]
Joints = dict[str, float]


class PlacesForm:
    """The field of the places, and what fills it."""

    def __init__(
        self,
        view: PageView,
        field: Callable[..., Any],
        button: Callable[[str, Act], None],
        attempt: Callable[[str, Act], Any],
    ) -> None:
        """Build it of the tab's own fields and buttons; ``attempt`` says what is refused."""
        self._view, self._robot = view, view.robot
        names = " ".join(("x y z", *outer_axes(view.robot)))
        self._text = ui.textarea("Places").classes("field places").mark("teach-places")
        self._text.props(
            f'dense outlined stack-label no-error-icon rows=2 placeholder="{names}, one a line; '
            'empty: where both stand"'
        )
        self._text.set_enabled(view.is_operator)
        with ui.element("div").classes("row-line"):
            button("Take twin", partial(self._take, twin_at))
            button("Take real", partial(self._take, real_at))
            # The browser drags, and tells where it ended.
            drag = push_button("In picture", None, props="data-drag aria-pressed=false")
            drag.set_enabled(view.is_operator)
            button("Clear", self._clear)

        async def drop(event: Any) -> None:
            await attempt("In picture", partial(self._drop, event.args))

        ui.on("dropped", drop)
        with ui.element("div").classes("target"):
            self._columns = field("Columns", "", "teach-columns", "1")
            self._column_mm = field("Pitch x", "mm", "teach-pitch-x", "0")
            self._above = field("Above", "mm", "teach-above", "50")
            self._rows = field("Rows", "", "teach-rows", "1")
            self._row_mm = field("Pitch y", "mm", "teach-pitch-y", "0")
            button("Grid", self._grid)

    @property
    def places(self) -> tuple[Place, ...]:
        """What stands in the field.

        Raises:
            TeachError: A line is no place.
        """
        return read_places(str(self._text.value or ""), self._robot)

    def clear(self) -> None:
        """Forget the places: they were used."""
        self._text.set_value("")
        ui.run_javascript("window.panel?.preview(null)")

    async def _clear(self) -> None:
        self.clear()

    def add(self, place: Place) -> None:
        """Put a place below the others."""
        before = str(self._text.value or "").rstrip()
        self._text.set_value(f"{before}\n{place.text}".lstrip())

    async def _drop(self, xyz_mm: Sequence[float]) -> tuple[str, str]:
        """Add the place where the marker was let go; the ghost stands there."""
        if not xyz_mm:
            raise TeachError("this browser does not draw the picture: type the place")
        x, y, z = map(float, xyz_mm)
        place = Place((x, y, z))
        (joints,) = await self._solved([place], ["there"], self._now())
        self.add(place)
        pose = {joint.name: joints[joint.name] for joint in self._robot.arm_joints}
        ui.run_javascript(f"window.panel?.preview({json.dumps(pose)})")
        return "good", f"{place.text} mm is within reach."

    async def _take(self, where: Callable[..., Joints]) -> None:
        """Add the place where one side stands; the two need not agree."""
        now = where(self._robot, self._view.door.snapshot())
        self.add(self._place_at(now))

    def _place_at(self, joints: Joints) -> Place:
        x, y, z = (1e3 * float(value) for value in self._view.desk.arm.pose(joints)[:3, 3])
        outer = (self._robot.joint(name) for name in outer_axes(self._robot))
        return Place((x, y, z), tuple(joints[joint.name] / joint.scale for joint in outer))

    async def _grid(self) -> tuple[str, str]:
        rows, columns = (
            int(parse_number(field.value, what, "", 1, MOST_PLACES))
            for what, field in (("Rows", self._rows), ("Columns", self._columns))
        )
        row_mm = parse_number(self._row_mm.value, "Pitch y", "mm")
        column_mm = parse_number(self._column_mm.value, "Pitch x", "mm")
        corners = self.places or (self._place_at(stands_at(self._robot, self._snapshot)),)
        made = grid_of(corners, rows, columns, row_mm, column_mm)
        names = [f"row {1 + k // columns}, column {1 + k % columns}" for k in range(len(made))]
        await self._solved(made, names, self._now())
        self._text.set_value("\n".join(place.text for place in made))
        return "good", f"{len(made)} places, all within reach."

    @property
    def _snapshot(self) -> Any:
        return self._view.door.snapshot()

    def _now(self) -> Joints:
        return twin_at(self._robot, self._snapshot)

    async def positions(self, program: Program) -> list[Position]:
        """Return the positions of all places; without any, that where both robots stand.

        An arm is bent there as at the newest position of ``program``, if it can be.

        Raises:
            TeachError: One is out of reach, or the robots move or disagree.
        """
        places = self.places
        if not places:
            return [position_of(self._robot, stands_at(self._robot, self._snapshot))]
        solved = await self._solved(places, _names(places), self._now(), self._bent(program))
        return [position_of(self._robot, joints) for joints in solved]

    async def handled(self, program: Program) -> tuple[list[Position], list[Position]]:
        """Return the positions above all places, and there.

        Raises:
            TeachError: As :meth:`positions`.
        """
        above_mm = parse_number(self._above.value, "Above", "mm", 0.0)
        places = self.places or (self._place_at(stands_at(self._robot, self._snapshot)),)
        names, now = _names(places), self._now()
        there = await self._solved(places, names, now, self._bent(program))
        raised = [_shifted(place, (0.0, 0.0, above_mm)) for place in places]
        names = [f"{above_mm:g} mm above {name}" for name in names]
        above = await self._solved(raised, names, now, self._elbow_at(there[0]))
        robot = self._robot
        return [position_of(robot, q) for q in above], [position_of(robot, q) for q in there]

    async def moved(self, taught: Mapping[int, Joints]) -> dict[int, list[Position]]:
        """Return positions moved along with the places: by as much as each is from the first.

        Args:
            taught: Joint positions by a position's number [rad or m]: where it is in round 1.

        Raises:
            TeachError: One is out of reach, or there are fewer than two places.
        """
        places = self.places
        if len(places) < 2:
            raise TeachError("places say where the lines are repeated: at least two are needed")
        found = {}
        for number, joints in taught.items():
            at = self._place_at(joints)
            first = places[0].xyz_mm
            ways = [tuple(a - b for a, b in zip(place.xyz_mm, first)) for place in places]
            moved = [
                Place(_shifted(at, way).xyz_mm, place.axes) for way, place in zip(ways, places)
            ]
            names = [f"P[{number}] at {name}" for name in _names(places)]
            solved = await self._solved(moved, names, joints, self._elbow_at(joints))
            found[number] = [position_of(self._robot, q) for q in solved]
        return found

    def _bent(self, program: Program) -> str:
        """Return how the arm is bent at the newest position; empty: there is none in joints."""
        newest = program.positions[-1:]
        if not newest or is_cartesian(newest[0]):
            return ""
        return self._elbow_at(joints_of(self._robot, program, newest[0].number))

    def _elbow_at(self, joints: Joints) -> str:
        """Return how a SCARA is bent there, in the twin controller's word; empty: it is none."""
        elbow = elbow_of(self._robot)
        if elbow is None:
            return ""
        return "lefty" if elbow.bend(joints[elbow.joint.name]) < 0.0 else "righty"

    async def _solved(
        self, places: Sequence[Place], names: Sequence[str], near: Joints, elbow: str = ""
    ) -> list[Joints]:
        """Return the joints at places, the arm bent as at the first; what it lacks is as ``near``.

        Raises:
            TeachError: One is out of reach; the text names it and says why.
        """
        found: list[Joints] = []
        arm = [joint.name for joint in self._robot.arm_joints]
        for place, name in zip(places, names):
            point = dict(zip("xyz", (1e-3 * value for value in place.xyz_mm)))
            answer = await self._view.door.judge(**point, elbow=elbow)
            # Only for the first place: from then on the arm would have to fold over on its way.
            if not found and elbow and not answer.values.get("target"):
                answer = await self._view.door.judge(**point, elbow="")
            if not answer.values.get("target"):
                raise TeachError(f"{name} ({place.text}): {answer.message}")
            elbow = answer.values["elbow"]
            there = dict(zip(answer.values["name"], map(float, answer.values["target"])))
            joints = near | {name: there[name] for name in arm}
            for axis, value in zip(outer_axes(self._robot), place.axes):
                joints[axis] = value * self._robot.joint(axis).scale
            found.append(joints)
        return found


def _names(places: Sequence[Place]) -> list[str]:
    return [f"place {number}" for number in range(1, len(places) + 1)]


def _shifted(place: Place, way_mm: Sequence[float]) -> Place:
    x, y, z = (a + b for a, b in zip(place.xyz_mm, way_mm))
    return Place((x, y, z), place.axes)
