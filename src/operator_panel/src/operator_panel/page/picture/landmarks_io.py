"""What stands around the robot in the picture: keep-out zones and reach; and views of it all."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Literal

from nicegui import ui
from scara_config import Robot
from scara_config.elbow import elbow_of
from scara_config.frames import TaughtFrame
from scara_description.taught_frames import pose_of
from scara_ros.page.page_library_io import plain

from operator_panel.page.view_io import PageView, push_button
from scara_description.urdf import Vector

Panes = dict[str, tuple[str, float]]
"""For each object that can be seen through its id: colour and opacity.

The browser needs them: it makes all else solid, and an object can be there before its material is.
"""


@dataclass(frozen=True)
class Glass:
    """A material that can be seen through.

    Attributes:
        colour: As ``#rrggbb``.
        opacity: 0 is nothing, 1 is solid.
    """

    colour: str
    opacity: float

    def cover(
        self, made: Any, panes: Panes, side: Literal["front", "back", "both"] = "front"
    ) -> None:
        """Give an object of the scene this material, and note it in ``panes``."""
        made.material(self.colour, self.opacity, side=side)
        panes[made.id] = (self.colour, self.opacity)


ZONE = Glass("#c81e1e", 0.12)
REACH = Glass("#6b7886", 0.55)
LINE_M = 0.004
AXIS_M = 0.06  # our choice: of a user frame
AXIS_COLOURS = ("#c62828", "#2e7d32", "#1565c0")
"""Of x, y and z, as tf viewers have them."""
LOWEST_M = -0.4  # a zone that goes on below the floor is shown down to here
SEGMENTS = 96
VIEWED_MM = 650.0  # reach of the robot that the views are drawn for: the article's
VIEWS: dict[str, tuple[Vector, Vector]] = {
    "Whole": ((1.42, -1.30, 0.72), (0.26, -0.08, -0.04)),
    "Top": ((0.26, -0.001, 2.0), (0.26, 0.0, 0.0)),
    "Front": ((2.1, 0.0, 0.25), (0.26, 0.0, 0.05)),
    "Side": ((0.26, -1.9, 0.25), (0.26, 0.0, 0.05)),
}
"""Name of a view: where the eye is and what it looks at [m]. None is called as a command is."""


def build_frame_axes(scene: ui.scene, view: PageView) -> None:
    """Add the axes of the user frames, and again where one is taught."""
    drawn: list[Any] = []

    def show() -> None:
        while drawn:
            drawn.pop().delete()
        with scene:
            frames = view.frames.numbered("user").items()
            drawn.extend(_axes(scene, number, frame) for number, frame in frames)

    view.on_frames(show)


def _axes(scene: ui.scene, number: int, frame: TaughtFrame) -> Any:
    pose = pose_of(frame)
    with scene.group().with_name(f"user frame {number}") as axes:
        for k, colour in enumerate(AXIS_COLOURS):
            length, wide, high = (AXIS_M if k == j else LINE_M for j in range(3))
            bar = scene.box(length, wide, high).material(colour)
            bar.move(*(0.5 * AXIS_M if k == j else 0.0 for j in range(3)))
    return axes.move(*pose[:3, 3].tolist()).rotate_R(pose[:3, :3].tolist())


def build_landmarks(scene: ui.scene, robot: Robot, glass: Panes) -> None:
    """Add zones and reach; what can be seen through is noted in ``glass``."""
    with scene:
        for zone in robot.keep_out:
            lower = [max(value * 1e-3, LOWEST_M) for value in zone.lower_mm]
            upper = [value * 1e-3 for value in zone.upper_mm]
            size = [high - low for low, high in zip(lower, upper)]
            middle = [0.5 * (low + high) for low, high in zip(lower, upper)]
            box = scene.box(size[0], size[1], size[2])
            ZONE.cover(box.move(*middle), glass)
            box.with_name(f"zone {zone.name}")
        # The reach goes round as far as the first joint turns; all the way where that is unknown.
        start, length = turn_of(robot)
        for radius in reach_radii(robot):
            ring = scene.ring(
                radius - LINE_M,
                radius,
                theta_segments=SEGMENTS,
                theta_start=start,
                theta_length=length,
            )
            REACH.cover(ring, glass, side="both")
            ring.with_name("reach")


def turn_of(robot: Robot) -> tuple[float, float]:
    """Return where the reach begins and how far it goes round, seen from above [rad]."""
    first, round_ = next(j for j in robot.arm_joints if j.si_unit == "rad"), 2.0 * math.pi
    screw = tuple(first.screw_axis or ())
    if screw not in ((0, 0, 1, 0, 0, 0), (0, 0, -1, 0, 0, 0)):
        return 0.0, round_
    start = first.lower if screw[2] > 0 else -first.upper
    return start, min(first.upper - first.lower, round_)


def reach_radii(robot: Robot) -> list[float]:
    """Return how far the tool can be from the base axis [m]: at most, and at least if known."""
    radii = [robot.reach_mm * 1e-3]
    if robot.geometry is not None and (elbow := elbow_of(robot)) is not None:
        first, second = robot.geometry.l1_mm * 1e-3, robot.geometry.l2_mm * 1e-3
        ends = (elbow.joint.lower, elbow.joint.upper)
        least, most = sorted(elbow.sign * end + elbow.zero for end in ends)
        folds = any(n % 2 for n in range(*(math.ceil(bend / math.pi) for bend in (least, most))))
        nearest = -1.0 if folds else min(math.cos(least), math.cos(most))
        radii.append(math.sqrt(first**2 + second**2 + 2.0 * first * second * nearest))
    return radii


def views_of(robot: Robot) -> dict[str, tuple[Vector, Vector]]:
    """Return the views, nearer or farther as the robot is smaller or larger than the article's."""
    share = robot.reach_mm / VIEWED_MM
    return {
        name: (_scaled(eye, share), _scaled(target, share)) for name, (eye, target) in VIEWS.items()
    }


def _scaled(place: Vector, share: float) -> Vector:
    x, y, z = (share * value for value in place)
    return x, y, z


def build_views(scene: ui.scene, view: PageView) -> None:
    """Build a button for each view, on the picture, and one to guide the twin by hand there."""
    with ui.element("div").classes("views"):
        for name, (eye, target) in views_of(view.robot).items():

            def look(eye: Vector = eye, target: Vector = target) -> None:
                scene.move_camera(
                    *eye, look_at_x=target[0], look_at_y=target[1], look_at_z=target[2], duration=0
                )

            with ui.element("button").props(f"type=button data-view={name}").on("click", look):
                plain(name)
        with ui.element("button").props("type=button data-follow aria-pressed=false"):
            plain("Follow")
        if view.is_operator:
            title = 'title="Drag the twin\'s tool in the picture; the real robot follows"'
            guide = push_button("Guide", None, props=f"data-guide aria-pressed=false {title}")
            view.guard(guide, "JOG")
