"""The demo's error figures in virtual time: real core, stand-in and simulator, to the digit.

A change of the maths shows here, however wide the limits of the demo are. The baseline is
``baseline.json``; ``./cell bench --virtual`` prints the figures, ``--renew`` stores them.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import msgspec
import pytest
import typer
from harness.running.thorough import thorough
from harness.virtual_cell.baseline import (
    RENEW,
    Baseline,
    BaselineError,
    better,
    read_baseline,
    worse,
    write_baseline,
)
from harness.virtual_cell.cell import CellError, VirtualCell
from harness.virtual_cell.experiments import Figures, measure
from harness.virtual_cell.files import load_files
from harness.virtual_cell.timing import Delays
from twin_controller.core.actions import (
    AnyAction,
    FollowTwin,
    RobotSetpoint,
    StreamAhead,
    StreamReal,
)

ROBOTS = ("fanuc_sr6ia", "fanuc_sr3ia", "scara_4axis", "articulated_six")
Tamper = Callable[[AnyAction], AnyAction]
FIGURES = Figures(1.0, 0.4, 0.3, 0.5, 0.2, 0.006, 0.1, 0.01)


@cache
def shipped(robot: str) -> dict[str, Figures]:
    """Return the figures of the shipped cell, measured once."""
    return measure(robot)


@pytest.mark.parametrize("robot", [ROBOTS[0], *thorough(*ROBOTS[1:])])
def test_no_figure_is_worse_than_its_baseline(robot: str) -> None:
    """Worse by 5 % is red; better by 5 % is told, because the baseline then hides the next loss."""
    baseline, found = read_baseline(), shipped(robot)
    assert set(found) == {"real_leads", "twin_leads"}
    lines = [line for name, new in found.items() for line in worse(robot, name, new, baseline)]
    assert not lines, "\n".join(lines)
    for line in better(baseline.figures[robot], found):
        warnings.warn(f"{robot} {line}: renew the baseline with {RENEW}", stacklevel=1)


def one_move(robot: str, **options: Any) -> VirtualCell:
    """Make a cell whose experiment ``twin_leads`` is short, and without ``real_leads``."""
    files = load_files(robot)
    experiment = msgspec.structs.replace(
        files.experiments.experiments["twin_leads"], visits=["P1", "P2"]
    )
    chosen = msgspec.structs.replace(files.experiments, experiments={"twin_leads": experiment})
    return VirtualCell(replace(files, experiments=chosen), **options)


@pytest.mark.thorough
def test_two_runs_are_equal_to_the_last_digit() -> None:
    """Nothing reads a clock, a random source or the order of a hash."""
    again = measure("fanuc_sr6ia", ("real_leads",))
    assert again["real_leads"] == shipped("fanuc_sr6ia")["real_leads"]


def with_first(action: FollowTwin, **changes: tuple[float, ...]) -> FollowTwin:
    """Return set points for the twin, the first of them changed."""
    first, *others = action.points
    return FollowTwin(action.stamp, (msgspec.structs.replace(first, **changes), *others))


def without_velocity(action: AnyAction) -> AnyAction:
    """Let the twin hold each position until the next one."""
    if isinstance(action, FollowTwin):
        still = (0.0,) * len(action.points[0].q)
        return with_first(action, qdot=still, qddot=still)
    return action


def without_acceleration(action: AnyAction) -> AnyAction:
    """Let the twin go on in a straight line."""
    if isinstance(action, FollowTwin):
        return with_first(action, qddot=(0.0,) * len(action.points[0].q))
    return action


def five_ms_older(action: AnyAction) -> AnyAction:
    """Let the twin believe that its set points are 5 ms younger than they are."""
    if isinstance(action, FollowTwin):
        return msgspec.structs.replace(action, stamp=action.stamp + 0.005)
    return action


def shifted(setpoint: RobotSetpoint) -> RobotSetpoint:
    """Return a set point beside."""
    return msgspec.structs.replace(setpoint, q=(setpoint.q[0] + 3.3e-4, *setpoint.q[1:]))


def beside(action: AnyAction) -> AnyAction:
    """Send the robot a third of a milliradian beside: an even delay would be measured."""
    if isinstance(action, StreamReal):
        return msgspec.structs.replace(action, setpoint=shifted(action.setpoint))
    if isinstance(action, StreamAhead):
        return msgspec.structs.replace(action, points=tuple(map(shifted, action.points)))
    return action


@pytest.mark.parametrize(
    ("experiment", "tamper", "make", "figure"),
    thorough(
        ("real_leads", without_acceleration, VirtualCell, "path_max_mm"),
        ("real_leads", five_ms_older, VirtualCell, "path_max_mm"),
        # What stands aside all the way is seen best where nothing moves.
        ("twin_leads", beside, one_move, "positioning_mm"),
    ),
)
def test_a_change_of_the_maths_is_red(
    experiment: str, tamper: Tamper, make: Callable[..., VirtualCell], figure: str
) -> None:
    """The test of the test: each of these hides behind the demo's limits.

    Each time a figure is held against its baseline below, by numbers.
    """
    found = measure("fanuc_sr6ia", (experiment,), lambda robot: make(robot, tamper=tamper))
    lines = worse("fanuc_sr6ia", experiment, found[experiment], read_baseline())
    assert any(figure in line for line in lines)


def test_following_without_velocity_is_red() -> None:
    """The pair comes so far apart that the controller pauses it: no figure comes at all."""
    with pytest.raises(CellError, match="PAUSED: the pair came apart"):
        measure(
            "fanuc_sr6ia",
            ("real_leads",),
            lambda robot: VirtualCell(robot, tamper=without_velocity),
        )


@pytest.mark.thorough
def test_late_packets_of_the_web_socket_are_made_up_for() -> None:
    """With 5 to 8 ms on both ways the pair is still far within the demo's limits."""
    late = Delays(to_twin=5e-3, from_twin=5e-3, jitter=3e-3)
    found = measure("fanuc_sr6ia", ("real_leads",), lambda robot: VirtualCell(robot, late, seed=7))
    assert found["real_leads"].path_max_mm < 13.0
    assert found["real_leads"].positioning_mm < 1.3


def test_the_text_of_a_worse_figure_says_what_to_do() -> None:
    """It names figure, new value, baseline and its age, and how to renew it."""
    baseline = Baseline("2026-01-31", "abc", {"r": {"real_leads": FIGURES}})
    new = msgspec.structs.replace(FIGURES, path_max_mm=1.06)
    assert worse("r", "real_leads", new, baseline) == [
        "r real_leads: path_max_mm = 1.06, baseline 1 of 2026-01-31, commit abc: +6.0 %",
        "The maths of following, planning, control or the wires has changed. Find the change; if "
        f"it is meant, renew the baseline with {RENEW} and commit it with the reason.",
    ]


@pytest.mark.parametrize("factor", [0.5, 1.0, 1.049])
def test_a_figure_within_five_percent_is_not_worse(factor: float) -> None:
    """Smaller changes are another processor's or another library's."""
    baseline = Baseline("2026-01-31", "abc", {"r": {"real_leads": FIGURES}})
    new = msgspec.structs.replace(FIGURES, path_max_mm=factor)
    assert worse("r", "real_leads", new, baseline) == []


def test_a_figure_that_is_half_as_large_is_told() -> None:
    """A baseline that is too high hides the next loss."""
    new = msgspec.structs.replace(FIGURES, path_max_mm=0.5)
    told = better({"real_leads": FIGURES}, {"real_leads": new})
    assert told == ["real_leads: path_max_mm = 0.5, baseline 1: -50.0 %"]


def test_a_baseline_that_is_missing_says_how_to_write_one(tmp_path: Path) -> None:
    """Without a file, and without the robot in it."""
    path = tmp_path / "baseline.json"
    with pytest.raises(BaselineError, match=r"--virtual --renew"):
        read_baseline(path)
    write_baseline(Baseline("2026-01-31", "abc", {"r": {"real_leads": FIGURES}}), path)
    assert read_baseline(path).figures["r"]["real_leads"] == FIGURES
    with pytest.raises(BaselineError, match="no baseline for r twin_leads"):
        worse("r", "twin_leads", FIGURES, read_baseline(path))


def test_the_figures_of_a_robot_that_somebody_made_are_shown(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """There is no baseline to hold them to, and that is no fault."""
    from harness.virtual_cell import __main__ as command

    monkeypatch.setattr("harness.virtual_cell.experiments.measure", lambda _: {"made": FIGURES})
    with pytest.raises(typer.Exit) as ended:
        command.main(["mine"])
    assert ended.value.exit_code == 0 and "mine" in capsys.readouterr().out
    with pytest.raises(BaselineError, match="no baseline for fanuc_sr6ia made"):
        command.main(["fanuc_sr6ia"])


def test_a_baseline_is_renewed_of_all_robots_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """It has one date and one commit: those of the others would be younger than their figures."""
    from harness.virtual_cell import __main__ as command

    written: list[Baseline] = []
    monkeypatch.setattr("harness.virtual_cell.experiments.measure", lambda _: {"made": FIGURES})
    monkeypatch.setattr("harness.virtual_cell.baseline.write_baseline", written.append)
    with pytest.raises(typer.BadParameter, match="name no robot"):
        command.main([ROBOTS[0]], renew=True)
    command.main(renew=True, as_json=True)
    assert [tuple(baseline.figures) for baseline in written] == [ROBOTS]
