"""What the loop of one joint keeps from step to step, where C can reach it if it was built.

``scara_loops.c`` is built by catkin as ``_scara_loops``. Without it (a workspace that was not
built, another interpreter) the same names are plain Python slots, and Python computes all: the same
bits, more slowly.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

from scara_control.joint_motion import AxisMotion
from scara_control.motion.plan import Path

from scara_simulation.config import LoopGains
from scara_simulation.joints.model import JointModel
from scara_simulation.track_queue import Piece, TrackQueue

try:
    import _scara_loops as built
except ImportError:
    built = None

Mode = Literal["trajectory", "position", "velocity"]


class PlainCells:
    """The cells as Python keeps them."""

    __slots__ = (
        "_behind",
        "_integral",
        "_last_velocity",
        "_model_based",
        "_path",
        "_queue",
        "_wanted",
        "applied_effort",
        "holding",
        "loop_gains",
        "mode",
        "model",
        "position_setpoint",
        "saturated_steps",
        "velocity_setpoint",
    )
    _behind: bool
    _integral: float
    _last_velocity: float
    _model_based: bool
    _path: Path | None
    _queue: TrackQueue
    _wanted: AxisMotion
    applied_effort: float
    holding: bool
    loop_gains: LoopGains
    mode: Mode
    model: JointModel
    position_setpoint: float
    saturated_steps: int
    velocity_setpoint: float

    def keep_piece(self, piece: Piece | None) -> None:
        """Forget the piece: Python asks the track itself."""


if TYPE_CHECKING or built is None:
    Cells = PlainCells
else:
    Cells = built.Cells

step_efforts: Any = None if built is None else built.efforts
"""All joints' efforts of one step by C; None: it was not built."""
