"""A machine that stood still: nothing catches up faster than a joint moves, and it is said."""

from __future__ import annotations

import pytest
from harness.running.thorough import thorough
from harness.scenes.steps import AWAY, run_program
from harness.scenes.troubled import TroubledCell, desk_files, fastest_twin_percent
from harness.virtual_cell.files import CellFiles, load_files

STALLS_S = (*thorough(0.1), 0.15, *thorough(0.3, 0.5))


def files(links: str) -> CellFiles:
    """Return a cell with strict link limits, or with those of a desk."""
    return desk_files("fanuc_sr6ia") if links == "desk" else load_files("fanuc_sr6ia")


def ready() -> TroubledCell:
    """Give an idle cell whose robot runs at its full override."""
    cell = TroubledCell(desk_files("fanuc_sr6ia"))
    cell.real.robot.write_override(100)
    cell.connect()
    cell.schedule.run(1.0)
    return cell


@pytest.mark.parametrize("stall", STALLS_S)
def test_a_twin_that_leads_catches_up_no_faster_than_its_joints(stall: float) -> None:
    """The simulator stands still in a move at full speed; its set points go on."""
    with ready() as cell:
        begun = cell.schedule.now
        assert cell.operate("MOVE_JOINTS", target=AWAY, speed_percent=100.0).success
        cell.schedule.run(0.4)
        cell.stand_simulator(stall)
        cell.schedule.run(stall + 1.5)
        assert 40.0 < fastest_twin_percent(cell, begun) <= 100.0


@pytest.mark.parametrize("stall", STALLS_S)
def test_a_twin_that_follows_catches_up_no_faster_than_its_joints(stall: float) -> None:
    """The real robot leads by its program; simulator, or simulator and controller, stand still."""
    for both in (False, True):
        with ready() as cell:
            run_program(cell)
            begun = cell.schedule.now
            cell.schedule.run(0.1)
            cell.stand_simulator(stall)
            if both:
                cell.stand_controller(stall)
            cell.schedule.run(stall + 1.5)
            assert 20.0 < fastest_twin_percent(cell, begun) <= 100.0


@pytest.mark.parametrize(("links", "stall"), [("strict", 0.31), ("desk", 0.31)])
def test_a_stall_is_named_for_what_it_is(links: str, stall: float) -> None:
    """Not a clock that jumped, and not only a pair that came apart."""
    with TroubledCell(files(links)) as cell:
        cell.real.robot.write_override(100)
        cell.connect()
        run_program(cell)
        cell.schedule.run(0.5)
        cell.stand_simulator(stall)
        cell.stand_controller(stall)
        cell.schedule.run(stall + 1.0)
        told = [d.why for d in cell.decisions if d.trigger in ("LINK_LOST", "DIVERGED")]
        assert all("this machine stood still for 0.31 s" in why for why in told), told
        assert not any("jumped" in why for why in told)
        assert told or links == "desk"
