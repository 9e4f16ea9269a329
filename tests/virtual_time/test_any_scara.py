"""SCARAs from three numbers drive both experiments as they were made, without an edit.

By night. Each time robot_doctor/test_new_scara.py holds their files, and test_kit_robot.py both
experiments. The same figures: ``./cell bench --plants --scaras 20``.
"""

from __future__ import annotations

import pytest

from bench.scaras import rows_of, trials_of

MADE = 20


@pytest.mark.thorough
def test_made_scaras_and_their_twins_keep_together() -> None:
    """On both plants, whoever leads, with the kit's map and with the ring: median and worst."""
    tried = [trials_of(seed) for seed in range(MADE)]
    ended = [trial.ended for trials in tried for trial in trials.values() if trial.ended]
    assert not ended
    assert not [row for row in rows_of(tried) if not row.holds]
