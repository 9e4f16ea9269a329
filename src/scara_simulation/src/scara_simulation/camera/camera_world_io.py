"""What the camera sees.

It sees a world of its own, only for pictures, drawn by PyBullet's software renderer.
"""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pybullet
from scara_config import ConfigError
from scara_control.dynamics.engine_io import joint_infos, new_engine
from typing_extensions import Self

from scara_description.urdf import without_world
from scara_simulation.camera.config import CameraConfig
from scara_simulation.camera.round_shapes import NAME, cylinder_mesh, with_round_shapes

NOTHING = -1


@dataclass(frozen=True)
class Part:
    """A cylinder along its z.

    It has its middle in the root frame [m], orientation x, y, z, w, size [m], red, green, blue,
    opacity.
    """

    position: tuple[float, float, float]
    orientation: tuple[float, float, float, float]
    radius: float
    height: float
    colour: tuple[float, float, float, float]


class CameraWorld:
    """The cell as pictures. A context manager; close it to free the renderer."""

    def __init__(self, urdf: Path, config: CameraConfig) -> None:
        """Load the cell at the zero pose.

        Raises:
            ConfigError: The URDF cannot be loaded.
        """
        self._config = config
        self._view = config.pose.view().ravel(order="F").tolist()
        projection = config.optics.projection()
        projection[:2, 2] += (
            1.0 / config.width_px,
            1.0 / config.height_px,
        )  # this renderer looks at a pixel's lower left corner
        self._projection = projection.ravel(order="F").tolist()
        self._parts: list[tuple[int, Part]] = []
        self._folder = Path(tempfile.mkdtemp(prefix="camera_"))
        self._client: int = new_engine()
        try:
            file = self._folder / urdf.name
            (self._folder / NAME).write_text(
                cylinder_mesh(self._config.round_edges), encoding="ascii"
            )
            try:
                text = without_world(urdf.read_text(encoding="utf-8"))
                file.write_text(with_round_shapes(text), encoding="utf-8")
                self._body: int = pybullet.loadURDF(
                    str(file), useFixedBase=True, physicsClientId=self._client
                )
            except (OSError, SyntaxError, pybullet.error) as error:
                raise ConfigError(f"{urdf}: cannot be drawn: {error}") from error
            self._joints = {
                info[1].decode(): info[0]
                for info in joint_infos(self._body, self._client)
                if info[2] != pybullet.JOINT_FIXED
            }
            self.root: str = pybullet.getBodyInfo(self._body, physicsClientId=self._client)[
                0
            ].decode()
        # Nobody leaves a context that was never entered.
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Free the renderer."""
        if self._client >= 0:
            pybullet.disconnect(physicsClientId=self._client)
            self._client = -1
        shutil.rmtree(self._folder, ignore_errors=True)

    def place(self, positions: Mapping[str, float]) -> None:
        """Put joints there [rad] or [m]; names that the cell does not have count for nothing."""
        for name, q in positions.items():
            if name in self._joints:
                pybullet.resetJointState(
                    self._body, self._joints[name], q, physicsClientId=self._client
                )

    def place_parts(self, parts: Sequence[Part]) -> None:
        """Put parts there; what is no longer among them is gone."""
        while len(self._parts) > len(parts):
            pybullet.removeBody(self._parts.pop()[0], physicsClientId=self._client)
        for index, part in enumerate(parts):
            if index == len(self._parts):
                self._parts.append((self._make(part), part))
                continue
            body, old = self._parts[index]
            # The engine cannot change the size of a shape.
            if (old.radius, old.height, old.colour) != (part.radius, part.height, part.colour):
                pybullet.removeBody(body, physicsClientId=self._client)
                body = self._make(part)
            pybullet.resetBasePositionAndOrientation(
                body, part.position, part.orientation, physicsClientId=self._client
            )
            self._parts[index] = (body, part)

    def picture(self) -> np.ndarray:
        """Draw the cell: red, green, blue, shape (height, width, 3), dtype uint8."""
        config = self._config
        _, _, pixels, _, mask = pybullet.getCameraImage(
            config.width_px,
            config.height_px,
            self._view,
            self._projection,
            lightDirection=config.light,
            shadow=int(config.shadows),
            renderer=pybullet.ER_TINY_RENDERER,
            physicsClientId=self._client,
        )
        colours = (
            np.asarray(pixels, dtype=np.uint8)
            .reshape(config.height_px, config.width_px, 4)[:, :, :3]
            .copy()
        )
        colours[np.asarray(mask).reshape(config.height_px, config.width_px) == NOTHING] = (
            config.background
        )
        return colours

    def _make(self, part: Part) -> int:
        shape = pybullet.createVisualShape(
            pybullet.GEOM_MESH,
            fileName=str(self._folder / NAME),
            meshScale=[part.radius, part.radius, part.height],
            rgbaColor=part.colour,
            physicsClientId=self._client,
        )
        body: int = pybullet.createMultiBody(
            baseVisualShapeIndex=shape,
            basePosition=part.position,
            baseOrientation=part.orientation,
            physicsClientId=self._client,
        )
        return body
