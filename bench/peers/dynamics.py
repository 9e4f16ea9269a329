"""Rigid-body dynamics by pinocchio and MuJoCo on a URDF.

Mass matrix, bias, forward kinematics, Jacobian, speed of a step.
"""

from __future__ import annotations

import re
import time
from pathlib import Path
from typing import Any


class Pinocchio:
    """Loads a URDF; joints by name, in the order of the caller."""

    def __init__(self, urdf: str, joints: list[str], frame: str, gravity: float) -> None:
        """Load the model; ``frame`` is where poses are asked for."""
        import numpy as np
        import pinocchio as pin

        self.np, self.pin = np, pin
        self.model = pin.buildModelFromUrdf(urdf)
        self.model.gravity.linear = np.array([0.0, 0.0, -gravity])
        self.data = self.model.createData()
        ids = [self.model.getJointId(name) for name in joints]
        self.at = [self.model.joints[k].idx_q for k in ids]
        self.along = [self.model.joints[k].idx_v for k in ids]
        self.frame = self.model.getFrameId(frame)
        self.version = f"pinocchio {pin.__version__}"

    def _spread(self, values: list[float], places: list[int], size: int) -> Any:
        vector = self.np.zeros(size)
        vector[places] = values
        return vector

    def dynamics(self, states: list[list[list[float]]]) -> list[list[Any]]:
        """Return mass matrix and bias (velocity coupling and gravity) for each (q, qdot)."""
        found = []
        for q, qdot in states:
            position, velocity = (
                self._spread(q, self.at, self.model.nq),
                self._spread(qdot, self.along, self.model.nv),
            )
            mass = self.pin.crba(self.model, self.data, position)
            mass = self.np.triu(mass) + self.np.triu(mass, 1).T
            bias = self.pin.nonLinearEffects(self.model, self.data, position, velocity)
            found.append(
                [mass[self.np.ix_(self.along, self.along)].tolist(), bias[self.along].tolist()]
            )
        return found

    def kinematics(self, poses: list[list[float]]) -> list[list[Any]]:
        """Return the frame's pose (4, 4) and Jacobian (6, n; omega first, base axes) for each q."""
        found = []
        for q in poses:
            position = self._spread(q, self.at, self.model.nq)
            jacobian = self.pin.computeFrameJacobian(
                self.model,
                self.data,
                position,
                self.frame,
                self.pin.ReferenceFrame.LOCAL_WORLD_ALIGNED,
            )[:, self.along]
            pose = self.pin.updateFramePlacement(self.model, self.data, self.frame).homogeneous
            found.append([pose.tolist(), self.np.vstack([jacobian[3:], jacobian[:3]]).tolist()])
        return found


class Mujoco:
    """Loads the same URDF, without what is only to be looked at."""

    def __init__(self, urdf: str, joints: list[str], gravity: float, step: float) -> None:
        """Load the model; ``step`` is the time step [s]."""
        import mujoco
        import numpy as np

        self.np, self.mujoco = np, mujoco
        options = '<mujoco><compiler fusestatic="true" discardvisual="true"/></mujoco>'
        text = re.sub(
            r"(<robot\b[^>]*>)", rf"\1{options}", Path(urdf).read_text(encoding="utf-8"), count=1
        )
        self.model = mujoco.MjModel.from_xml_string(text)
        self.model.opt.timestep, self.model.opt.gravity[:] = step, (0.0, 0.0, -gravity)
        self.data = mujoco.MjData(self.model)
        ids = [mujoco.mj_name2id(self.model, mujoco.mjtObj.mjOBJ_JOINT, name) for name in joints]
        self.at, self.along = self.model.jnt_qposadr[ids], self.model.jnt_dofadr[ids]
        self.version = f"MuJoCo {mujoco.__version__}"

    def dynamics(self, states: list[list[list[float]]]) -> list[list[Any]]:
        """Return mass matrix and bias for each (q, qdot)."""
        found, full = [], self.np.zeros((self.model.nv, self.model.nv))
        for q, qdot in states:
            self.data.qpos[self.at], self.data.qvel[self.along] = q, qdot
            self.mujoco.mj_forward(self.model, self.data)
            self._full(full)
            bias = self.data.qfrc_bias[self.along]
            found.append([full[self.np.ix_(self.along, self.along)].tolist(), bias.tolist()])
        return found

    def _full(self, full: Any) -> None:
        """Expand the sparse mass matrix; the function's arguments have changed between versions."""
        try:
            self.mujoco.mj_fullM(self.model, full, self.data.qM)
        except (AttributeError, TypeError):
            self.mujoco.mj_fullM(self.model, self.data, full)

    def round(self, steps: int, pose: list[float]) -> list[float]:
        """Hold a pose by its bias effort and return the seconds of one step."""
        self.mujoco.mj_resetData(self.model, self.data)
        self.data.qpos[self.at] = pose
        model, data, step = self.model, self.data, self.mujoco.mj_step
        begun = time.perf_counter()
        for _ in range(steps):
            data.qfrc_applied[:] = data.qfrc_bias
            step(model, data)
        return [(time.perf_counter() - begun) / steps]
