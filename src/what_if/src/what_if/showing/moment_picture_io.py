"""A picture of the worst moment: the whole cell, and from near what it is about.

What is drawn is what was judged: the same bodies, at the same places.
"""

from __future__ import annotations

import io
import math
import textwrap
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pybullet
from PIL import Image, ImageDraw, ImageFont
from scara_control.dynamics.engine_io import new_engine
from scara_simulation.camera.config import load_camera
from scara_simulation.camera.optics import CameraPose, Optics
from scipy.spatial.transform import Rotation

from what_if.geometry.bodies import Body, Kind
from what_if.showing.moment import Moment

Colours = npt.NDArray[np.uint8]
Numbers = npt.NDArray[np.int64]
COLOURS = {
    Kind.ARM: (0.62, 0.67, 0.74),
    Kind.NOZZLE: (0.32, 0.36, 0.42),
    Kind.HELD: (0.95, 0.77, 0.30),
    Kind.PART: (0.95, 0.77, 0.30),
    Kind.REST: (0.78, 0.80, 0.83),
    Kind.CELL: (0.86, 0.87, 0.89),
    Kind.OBSTACLE: (0.55, 0.45, 0.38),
    Kind.PERSON: (0.35, 0.55, 0.90),
    Kind.ZONE: (0.90, 0.35, 0.35),
}
MARKED = ((0.85, 0.08, 0.16), (0.98, 0.52, 0.06))
"""The two bodies that it is about, that of the arm first."""
GLASS = (Kind.ZONE, Kind.PERSON)
CLEAR = 0.3
"""What can be seen through covers so much of what is behind it; our choice."""
WIDTH, HEIGHT = 480, 360
NEAR_M = 0.3
"""The near view is taken from so far away [m]; our choice: the nozzle and some parts are in it."""
TILTS_DEG, TURNS = (20.0, 45.0), 8
"""The near view is taken from where most of the marked bodies is seen; our choice: of these."""
TRIAL = 8
"""Of so many columns and rows one is drawn to find that out."""
CAPTION_PX, TEXT_PX, LETTERS = 64, 17, 112
RING_PX, RING_RGB = 15, (190, 0, 40)
LIGHT = (0.6, -0.5, 1.6)
NOTHING = -1


def picture_of(moment: Moment, words: Sequence[str], directory: Path | str | None = None) -> bytes:
    """Return a moment as a PNG file: the cell on the left, from near on the right, words below.

    Args:
        moment: What is drawn.
        words: Lines below the picture.
        directory: Of camera.yaml; default: the package scara_config.

    Raises:
        ConfigError: camera.yaml is missing or wrong.
    """
    camera = load_camera(directory)
    optics = replace(camera.optics, width=WIDTH, height=HEIGHT)
    with _stage(moment) as stage:
        views = (camera.pose, stage.near_view(optics))
        shots = [stage.draw(optics, view, camera.background) for view in views]
    paper = Image.new("RGB", (2 * WIDTH, HEIGHT + CAPTION_PX), "white")
    for k, (view, shot) in enumerate(zip(views, shots)):
        image = Image.fromarray(shot)
        _ring(image, optics, view, moment)
        paper.paste(image, (k * WIDTH, 0))
    text = "\n".join(line for each in words for line in textwrap.wrap(each, LETTERS))
    draw = ImageDraw.Draw(paper)
    draw.text((10, HEIGHT + 8), text, "black", ImageFont.load_default(TEXT_PX))
    file = io.BytesIO()
    paper.save(file, "PNG", optimize=True)
    return file.getvalue()


class _Stage:
    """The bodies of a moment in an engine that only draws."""

    def __init__(self, moment: Moment, client: int) -> None:
        self._moment, self._client = moment, client
        self._made: dict[int, int] = {}
        for number, body in enumerate(moment.bodies):
            if body.kind not in GLASS:
                self._make(number, body)

    def near_view(self, optics: Optics) -> CameraPose:
        """Return the view from near that shows most of what it is about."""
        small = replace(optics, width=optics.width // TRIAL, height=optics.height // TRIAL)
        x, y, z = self._moment.place
        views = []
        for tilt in map(math.radians, TILTS_DEG):
            aside, up = NEAR_M * math.cos(tilt), NEAR_M * math.sin(tilt)
            for turn in (2.0 * math.pi * k / TURNS for k in range(TURNS)):
                eye = (x + aside * math.cos(turn), y + aside * math.sin(turn), z + up)
                views.append(CameraPose(eye, (x, y, z)))
        return max(views, key=lambda view: self._seen(small, view))

    def draw(self, optics: Optics, view: CameraPose, background: tuple[int, int, int]) -> Colours:
        """Draw it; people, and the zone that it is about, can be seen through."""
        solid, _ = self._shoot(optics, view, background)
        # A zone is drawn only where it is about that one.
        glass = [
            k
            for k, body in enumerate(self._moment.bodies)
            if body.kind is Kind.PERSON or (body.kind is Kind.ZONE and k in self._moment.marked)
        ]
        if not glass:
            return solid
        for number in glass:
            self._make(number, self._moment.bodies[number])
        all_of_it, mask = self._shoot(optics, view, background)
        covered = np.isin(mask, [self._made[number] for number in glass])[:, :, None]
        for number in glass:
            # Away again: the next view begins with what is solid alone.
            pybullet.removeBody(self._made.pop(number), physicsClientId=self._client)
        mixed = np.where(covered, (1.0 - CLEAR) * solid + CLEAR * all_of_it, solid)
        return mixed.astype(np.uint8)

    def _seen(self, optics: Optics, view: CameraPose) -> tuple[int, int]:
        """Return how much is seen of the marked body that is hidden most, and of all of them."""
        _, mask = self._shoot(optics, view, (0, 0, 0))
        marked = [self._made[k] for k in self._moment.marked if k in self._made]
        counts = [int(np.count_nonzero(mask == body)) for body in marked]
        return min(counts, default=0), sum(counts)

    def _shoot(
        self, optics: Optics, view: CameraPose, background: tuple[int, int, int]
    ) -> tuple[Colours, Numbers]:
        """Return the colours, and which body is seen at each pixel."""
        size = (optics.height, optics.width)
        _, _, pixels, _, mask = pybullet.getCameraImage(
            optics.width,
            optics.height,
            # PyBullet takes matrices column by column, as OpenGL does.
            view.view().ravel(order="F").tolist(),
            optics.projection().ravel(order="F").tolist(),
            lightDirection=LIGHT,
            shadow=0,
            # Drawn by the processor: a cell may have no display and no OpenGL.
            renderer=pybullet.ER_TINY_RENDERER,
            physicsClientId=self._client,
        )
        seen = np.asarray(mask).reshape(size)
        colours = np.asarray(pixels, dtype=np.uint8).reshape(*size, 4)[:, :, :3].copy()
        colours[seen == NOTHING] = background
        return colours, seen

    def _make(self, number: int, body: Body) -> None:
        marked, pose = self._moment.marked, self._moment.poses[number]
        colour = MARKED[min(marked.index(number), 1)] if number in marked else COLOURS[body.kind]
        shape = pybullet.createVisualShape(
            **_shape(body), rgbaColor=(*colour, 1.0), physicsClientId=self._client
        )
        self._made[number] = pybullet.createMultiBody(
            baseVisualShapeIndex=shape,
            basePosition=pose[:3, 3].tolist(),
            baseOrientation=Rotation.from_matrix(pose[:3, :3]).as_quat().tolist(),
            physicsClientId=self._client,
        )


def _shape(body: Body) -> dict[str, object]:
    """Return a body's shape in PyBullet's words."""
    if body.shape == "box":
        return {"shapeType": pybullet.GEOM_BOX, "halfExtents": body.half.tolist()}
    if body.shape == "cylinder":
        radius, length = body.size
        return {"shapeType": pybullet.GEOM_CYLINDER, "radius": radius, "length": length}
    return {"shapeType": pybullet.GEOM_SPHERE, "radius": body.size[0]}


@contextmanager
def _stage(moment: Moment) -> Iterator[_Stage]:
    client = new_engine()
    try:
        yield _Stage(moment, client)
    finally:
        pybullet.disconnect(physicsClientId=client)


def _ring(image: Image.Image, optics: Optics, view: CameraPose, moment: Moment) -> None:
    """Draw a ring around the place."""
    seen = optics.projection() @ view.view() @ np.array((*moment.place, 1.0))
    # Behind the camera; the division below would mirror it to the front.
    if seen[3] <= 0.0:
        return
    x = 0.5 * (1.0 + seen[0] / seen[3]) * optics.width
    y = 0.5 * (1.0 - seen[1] / seen[3]) * optics.height
    box = (x - RING_PX, y - RING_PX, x + RING_PX, y + RING_PX)
    ImageDraw.Draw(image).ellipse(box, outline=RING_RGB, width=2)
