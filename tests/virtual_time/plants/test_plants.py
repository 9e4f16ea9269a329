"""Robots that were made different, in virtual time: what the article's limits hold for.

``./cell bench --plants`` measures all of them, those too that are beyond the limits.
"""

from __future__ import annotations

import sys
from dataclasses import asdict, replace

import pytest
from harness.plants import trials
from harness.plants.trials import run_trial
from harness.plants.variants import FIELD, IDEAL, ROUGH_FOLLOWER, ROUGH_LEADER, VARIANTS, Variant
from harness.running.thorough import SEARCH, thorough
from harness.virtual_cell.cell import VirtualCell
from harness.virtual_cell.experiments import run_experiments
from harness.workspace import ROOT
from twin_experiments.report.analysis import Excess, Result

if str(ROOT) not in sys.path:
    sys.path.append(str(ROOT))

from bench.plant_tables import first_table
from bench.plants import _rows

PATH_PERCENT, REST_PERCENT = 5.0, 2.0
"""The article's errors, percent of reach."""
BY_NAME = {variant.name: variant for variant in VARIANTS}
ONE_BY_ONE = [
    ("real_leads", "clocks read wrongly by up to 5 ms"),
    ("real_leads", "controller pauses for 50 ms each second"),
    ("twin_leads", "lag 148 ms"),
    ("twin_leads", "servo without feed-forward"),
    ("real_leads", "lag 148 ms"),
    ("real_leads", "encoder noise 0.01 deg rms"),
    ("twin_leads", "lag of each axis its own (14, 22, 35 Hz)"),
    ("twin_leads", "clocks read wrongly by up to 5 ms"),
    ("twin_leads", "readings each 8 ms"),
]
SHORT = 4 if SEARCH else 3
"""A twin that leads goes to so many places: the first move and those that follow a measured one."""


@pytest.mark.parametrize(
    ("leader", "variant"),
    [
        ("real_leads", ROUGH_LEADER),
        *thorough(
            ("twin_leads", ROUGH_FOLLOWER),
            *((leader, BY_NAME[name]) for leader, name in ONE_BY_ONE),
        ),
    ],
)
def test_the_articles_limits_hold_on_a_robot_made_different(leader: str, variant: Variant) -> None:
    """At 50 % speed, the first move included, without removing any lag.

    All differences of a leader at once each time; thoroughly those of a follower, and each alone.
    """
    trial = run_trial("fanuc_sr6ia", variant, leader, 50.0, SHORT)
    assert not trial.ended, trial
    assert trial.path_percent is not None and trial.path_percent <= PATH_PERCENT, trial
    assert trial.rest_percent is not None and trial.rest_percent <= REST_PERCENT, trial


@pytest.mark.thorough
@pytest.mark.parametrize("robot", ["fanuc_sr6ia", "fanuc_sr3ia", "scara_4axis", "articulated_six"])
def test_a_field_robot_that_follows_is_measured_and_stays_within_the_goals(robot: str) -> None:
    """Nothing of its plant was told to the controller, and the first move counts."""
    trial = run_trial(robot, FIELD, "twin_leads", 50.0, SHORT)
    assert not trial.ended, trial
    assert trial.path_percent is not None and trial.path_percent <= 2.5, trial
    assert trial.rest_percent is not None and trial.rest_percent <= 0.2, trial


@pytest.mark.thorough
def test_a_trial_that_ends_early_says_why() -> None:
    """A robot with half the acceleration comes apart from the twin at 50 % speed."""
    trial = run_trial("fanuc_sr6ia", BY_NAME["half the acceleration"], "twin_leads", 50.0)
    assert trial.path_percent is None
    assert trial.ended.startswith("PAUSED: the pair came apart")


@pytest.mark.parametrize("missed", [*thorough(""), "38.0 % of the time has no samples, limit 1 %"])
def test_what_is_not_known_is_no_figure_and_a_hole_ends_a_trial(
    missed: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nothing at rest is not 0.000 %; a figure beyond its limit alone ends nothing."""

    def made(cell: VirtualCell, names: list[str]) -> dict[str, Result]:
        (result,) = run_experiments(cell, names).values()
        assert result.comparison is not None and not result.reasons
        path = replace(result.comparison.path, max_percent=3.0)
        found = replace(result.comparison, path=path, rests=(), lag_s=None)
        beyond = Excess("path error", 3.0, cell.files.experiments.limits.path_error_percent)
        noisy = "both stood still at P1, expected P1 P2"
        reasons = tuple(filter(None, (beyond.text, noisy, missed)))
        return {names[0]: replace(result, comparison=found, reasons=reasons)}

    monkeypatch.setattr(trials, "run_experiments", made)
    trial = run_trial.__wrapped__("fanuc_sr6ia", IDEAL, "real_leads", 50.0)
    assert (trial.rest_percent, trial.lag_ms, trial.ended) == (None, None, missed)
    (line, _) = first_table({"trials": [asdict(trial)], "date": "", "commit": ""})[3:5]
    assert line.startswith("| fanuc_sr6ia, ideal | ") and line.endswith(" | - |"), "at rest"
    path, rest = _rows(trial)
    assert path.holds == (not missed) and not rest.holds
