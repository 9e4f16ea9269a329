"""Gains to begin with: those of the shipped robots come out of the method, and they are stable."""

from __future__ import annotations

import numpy as np
import pytest
from scara_simulation.tuning.proposal import MARGIN, propose
from scara_simulation.tuning.stability import KINDS, Plant, spectral_radius


def test_the_articles_robot_has_the_gains_of_its_file() -> None:
    """J = 2.301 kg m^2 and w = 60 rad/s give p 8284, d 276.1: pid_gains.yaml, to rounding."""
    ((bandwidth, gains),) = propose(np.array([[[2.301]], [[0.6]]]), [1.0], 1e-3)
    assert bandwidth == 60.0
    assert (gains.position.p, gains.position.d) == (8284.0, 276.1)
    assert gains.position.i_clamp == 1.5 and gains.velocity.p == 138.1


@pytest.mark.parametrize("smallest", [0.9, 0.2, 0.05, 0.01])
def test_a_joint_whose_inertia_varies_much_gets_a_lower_bandwidth_and_is_stable(
    smallest: float,
) -> None:
    """All gains times 1.9 are stable at the smallest and the largest inertia."""
    matrices = np.array([[[1.0]], [[smallest]]])
    ((_, loops),) = propose(matrices, [0.5], 1e-3)
    plant = Plant(matrices, np.array([0.0]), 1e-3)
    for kind in KINDS:
        gains = getattr(loops, kind)
        raised = type(gains)(p=MARGIN * gains.p, i=MARGIN * gains.i, d=MARGIN * gains.d)
        assert spectral_radius(plant, [(kind, raised)]) <= 1.0 + 1e-7
