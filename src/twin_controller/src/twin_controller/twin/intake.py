"""What a joint state of the twin has to pass before the core sees it."""

from __future__ import annotations

from collections.abc import Sequence

from scara_config.robot import Joint

from twin_controller.core.events import TwinMeasured
from twin_controller.plausible import TWIN_ACCELERATION, Plausibility, Reading, Verdict, judge
from twin_controller.twin.fields import PacketError

RANGE_MARGIN = 0.02
"""How far outside its range, as a part of it, a joint of the twin may be read.

Physics gives way at a limit."""


def take(
    state: Plausibility, event: TwinMeasured, joints: Sequence[Joint]
) -> tuple[Plausibility, Verdict]:
    """Judge one joint state; ``reason`` of the new state says why it was refused.

    Raises:
        PacketError: A joint is far outside its range.
    """
    for joint, q in zip(joints, event.motion.q):
        margin = RANGE_MARGIN * (joint.upper - joint.lower)
        if not joint.lower - margin <= q <= joint.upper + margin:
            limits = f"[{joint.lower:.6g}, {joint.upper:.6g}]"
            raise PacketError(f"position of {joint.name} = {q:g} is outside {limits}")
    return judge(state, Reading(event.motion, event.now), joints, TWIN_ACCELERATION)
