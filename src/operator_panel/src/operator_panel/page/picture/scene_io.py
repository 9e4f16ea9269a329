"""The cell in three dimensions: the twin solid, the real robot as a ghost, a preview as another."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from nicegui import ui
from scara_ros.page.page_library_io import tabs_of

from operator_panel.page.picture.landmarks_io import (
    Glass,
    Panes,
    build_frame_axes,
    build_landmarks,
    build_views,
    views_of,
)
from operator_panel.page.picture.look_back_io import build_look_back_button
from operator_panel.page.picture.told_io import build_apart, build_lead
from operator_panel.page.view_io import PageView
from scara_description.urdf import (
    JointFrame,
    Model,
    Shape,
    joint_transform,
    origin_transform,
)

GHOSTS = {"real": Glass("#2f7fe0", 0.38), "preview": Glass("#9b5de5", 0.42)}
SEGMENTS = 36


def build_scene(model: Model, view: PageView) -> dict[str, Any]:
    """Build the picture; return the object that the browser moves for each side and joint."""
    robot = view.robot
    with (
        ui.element("section").classes("card scene-card"),
        ui.element("div").classes("scene-body"),
    ):
        scene = ui.scene(
            width=640,
            height=360,
            grid=False,
            background_color="#ffffff",
            fps=25,
            click_events=[],
            camera=ui.scene.perspective_camera(fov=42, near=0.05, far=20),
        )
        scene.classes("scene")
        # In the model's place where a browser cannot draw it.
        with ui.element("figure").classes("still"):
            ui.element("img").props('src="/panel/still.jpg" alt="The cell, a still picture"')
            ui.element("figcaption").props("data-still")
        # The browser asks for the camera's pictures while this is shown.
        with ui.element("figure").classes("camera"):
            ui.element("img").props('data-camera alt="The twin\'s cell, seen by its camera"')
            ui.element("figcaption").props("data-camera-text")
        build_lead()
        with ui.element("div").classes("scene-head"):
            build_look_back_button()
            shown = {name: name for name in ("Model", "Both", "Camera")}
            tabs_of(shown, "show", "segmented scene-choice")
        build_views(scene, view)
        build_apart()
    builder = _Builder(scene, model)
    build_frame_axes(scene, view)
    build_landmarks(scene, robot, builder.panes)
    moved = {side: builder.tree(side) for side in ("twin", "real", "preview")}
    eye, (x, y, z) = views_of(robot)["Whole"]
    scene.move_camera(*eye, look_at_x=x, look_at_y=y, look_at_z=z, duration=0)
    return {"scene": scene.id, "joints": moved, "glass": builder.panes}


class _Builder:
    """Builds the tree of links once for each side; fixed parts only once."""

    def __init__(self, scene: ui.scene, model: Model) -> None:
        self._scene, self._model = scene, model
        self.panes: Panes = {}

    def tree(self, side: str) -> dict[str, dict[str, Any]]:
        """Build one side; return its moving groups by joint."""
        moving: dict[str, dict[str, Any]] = {}
        with self._scene, self._scene.group().with_name(side) as top:
            self._link(side, self._model.root, moving, fixed=True)
        if side == "preview":
            top.visible(False)
            moving["root"] = {"id": top.id}
        return moving

    def _link(self, side: str, link: str, moving: dict[str, dict[str, Any]], fixed: bool) -> None:
        if side == "twin" or not fixed:
            for shape in self._model.shapes[link]:
                self._shape(side, shape)
        for joint in self._model.joints:
            if joint.parent == link and not (side == "preview" and joint.name.startswith("table")):
                self._joint(side, joint, moving, fixed and not joint.moves)

    def _joint(
        self, side: str, joint: JointFrame, moving: dict[str, dict[str, Any]], fixed: bool
    ) -> None:
        with (
            _placed(self._scene.group(), joint_transform(joint, 0.0)),
            self._scene.group() as group,
        ):
            if joint.moves:
                moving[joint.name] = {
                    "id": group.id,
                    "axis": joint.axis,
                    "slides": joint.kind == "prismatic",
                }
            self._link(side, joint.child, moving, fixed)

    def _shape(self, side: str, shape: Shape) -> None:
        pose = origin_transform(shape.xyz, shape.rpy)
        if shape.kind == "box":
            width, depth, height = shape.size
            made: Any = self._scene.box(width, depth, height)
        elif shape.kind == "cylinder":
            made = self._scene.cylinder(shape.size[0], shape.size[0], shape.size[1], SEGMENTS)
            # A cylinder of the scene lies along y, one of a URDF along z.
            pose = pose @ origin_transform((0.0, 0.0, 0.0), (math.pi / 2, 0.0, 0.0))
        else:
            made = self._scene.sphere(shape.size[0], SEGMENTS, SEGMENTS // 2)
        _placed(made, pose)
        if side == "twin":
            made.material(shape.colour)
            return
        GHOSTS[side].cover(made, self.panes)


def _placed(made: Any, pose: np.ndarray) -> Any:
    """Move and turn an object of the scene."""
    return made.move(*(float(v) for v in pose[:3, 3])).rotate_R(
        [[float(v) for v in row] for row in pose[:3, :3]]
    )
