"""What a fit may change of the twin, as one structure, one vector, and one set of YAML values."""

from __future__ import annotations

import math
from collections.abc import Sequence

import msgspec
import numpy as np
import numpy.typing as npt
from scara_simulation.config import LoopGains

FloatArray = npt.NDArray[np.float64]
YamlValues = dict[str, dict[tuple[str, ...], float]]

FACTOR = 30.0
DELAY_SPAN = 0.02
LARGEST_BANDWIDTH = 250.0
"""[rad/s] A quarter of the physics rate; beyond it a wrong model would make the loop ring.

Our choice.
"""

LOOP = "loop speed"
"""How much faster a joint's loop is: its gains change by powers of it."""
LEAST_DAMPING, LEAST_FRICTION = 1e-3, 1e-3


class TwinModel(msgspec.Struct, frozen=True):
    """The twin's numbers that a fit may change, joints in robot.yaml's order.

    Attributes:
        gains: PID gains.
        damping: [N m s/rad], prismatic [N s/m].
        friction: Dry friction [N m], prismatic [N].
        bandwidth: Error feedback of the computed torque [rad/s]; kept at 0 without feed-forward.
        delay: From the instant of a position until the robot's register shows it [s].
        feed_forward: Whether inverse dynamics are used; never changed by a fit.
    """

    gains: tuple[LoopGains, ...]
    damping: tuple[float, ...]
    friction: tuple[float, ...]
    bandwidth: float
    delay: float
    feed_forward: bool


class Choice(msgspec.Struct, frozen=True):
    """What is fitted: columns of the joints that move in the recording.

    Also whether the delay can be seen in it.
    """

    columns: tuple[int, ...]
    delay: bool


def names_of(choice: Choice, joints: Sequence[str], model: TwinModel) -> list[str]:
    """Return the name of each entry of the vector."""
    per_joint = [
        f"{joints[k]} {what}" for k in choice.columns for what in (LOOP, "damping", "friction")
    ]
    shared = (["bandwidth"] if _has_bandwidth(model) else []) + (["delay"] if choice.delay else [])
    return per_joint + shared


def apply_vector(model: TwinModel, choice: Choice, x: FloatArray) -> TwinModel:
    r"""Return the model that the vector stands for; the zero vector is the model itself.

    Gains, damping, friction and bandwidth are multiplied by :math:`e^x`; a joint's loop is made
    faster as a whole (:math:`p \to p s^2, d \to d s, i \to i s^3`), which keeps its damping ratio.
    The delay is shifted by ``DELAY_SPAN`` x.

    Args:
        model: Where the fit starts.
        choice: What is fitted.
        x: Shape (k,), in the order of :func:`names_of`.
    """
    gains, damping, friction = list(model.gains), list(model.damping), list(model.friction)
    values = iter(float(value) for value in x)
    for k in choice.columns:
        faster, loop = math.exp(next(values)), gains[k].position
        loop = msgspec.structs.replace(
            loop, p=loop.p * faster**2, i=loop.i * faster**3, d=loop.d * faster
        )
        gains[k] = msgspec.structs.replace(gains[k], position=loop)
        damping[k] = max(damping[k], LEAST_DAMPING) * math.exp(next(values))
        friction[k] = max(friction[k], LEAST_FRICTION) * math.exp(next(values))
    bandwidth = (
        model.bandwidth * math.exp(next(values)) if _has_bandwidth(model) else model.bandwidth
    )
    delay = model.delay + DELAY_SPAN * next(values) if choice.delay else model.delay
    return TwinModel(
        tuple(gains), tuple(damping), tuple(friction), bandwidth, delay, model.feed_forward
    )


def bounds_of(
    choice: Choice, joints: Sequence[str], model: TwinModel
) -> tuple[FloatArray, FloatArray]:
    """Return lower and upper bounds of the vector.

    They lie a factor of ``FACTOR`` either way; the delay is not below zero.
    """
    names = names_of(choice, joints, model)
    upper = np.full(len(names), math.log(FACTOR))
    lower = -upper
    for k, name in enumerate(names):
        if name.endswith(LOOP):
            # p goes with the square of it.
            upper[k], lower[k] = math.log(FACTOR) / 2, -math.log(FACTOR) / 2
        elif name == "bandwidth":
            upper[k] = math.log(max(LARGEST_BANDWIDTH / model.bandwidth, 1.001))
        elif name == "delay":
            # By a hair below 0: the search begins at x = 0, which has to lie inside even without a
            # delay.
            upper[k], lower[k] = 1.0, -model.delay / DELAY_SPAN - 1e-6
    return lower, upper


def yaml_values(model: TwinModel, choice: Choice, joints: Sequence[str]) -> YamlValues:
    """Return what is to be written.

    It maps file name -> key path -> value, rounded to 4 significant digits.
    """
    gains: dict[tuple[str, ...], float] = {}
    simulation: dict[tuple[str, ...], float] = {}
    for k in choice.columns:
        position = model.gains[k].position
        gains |= {
            (joints[k], "position", key): _rounded(getattr(position, key))
            for key in ("p", "i", "d")
        }
        simulation[("joint_dynamics", joints[k], "damping")] = _rounded(model.damping[k])
        simulation[("joint_dynamics", joints[k], "friction")] = _rounded(model.friction[k])
    if _has_bandwidth(model):
        simulation[("tracking_bandwidth_rad_s",)] = _rounded(model.bandwidth)
    values: YamlValues = {"pid_gains.yaml": gains, "simulation.yaml": simulation}
    if choice.delay:
        values["twin_controller.yaml"] = {
            ("real", "sample_latency_ms"): max(0.0, _rounded(model.delay * 1e3))
        }
    return values


def _has_bandwidth(model: TwinModel) -> bool:
    return model.feed_forward and model.bandwidth > 0.0


def _rounded(value: float) -> float:
    return float(f"{value:.4g}")
