"""What stops, starts and queues a program, by how the robot was set up: the maker's manual."""

from __future__ import annotations

from typing import TYPE_CHECKING

import msgspec
import pytest
from fanuc_emulator.config import load_programs
from fanuc_emulator.tp.executor import ProgramState
from fanuc_emulator.uop import UO

from fanuc_emulator import alarms

if TYPE_CHECKING:
    from conftest import Bench

ABORTED, PAUSED, RUNNING = ProgramState.ABORTED, ProgramState.PAUSED, ProgramState.RUNNING
WAIT_LINE = 5
"""Of ARTICLE: a WAIT between two moves."""


def set_up(bench: Bench, **settings: object) -> Bench:
    """Return a robot that was set up otherwise."""
    changed = msgspec.structs.replace(bench.config.settings, **settings)
    config = msgspec.structs.replace(bench.config, settings=changed)
    made = type(bench)(config, bench.robot, load_programs(bench.robot))
    made.controller.write_override(100)
    made.run(0.01)
    return made


def start_moving(bench: Bench) -> None:
    """Run ARTICLE, started at the pendant, until it moves quickly."""
    bench.pulse("panel_run2")
    bench.run_until(lambda now: max(abs(v) for v in now.velocities) > 1.0)


def test_cstopi_as_delivered_lets_the_program_run_to_its_end(bench: Bench) -> None:
    """CSTOPI for ABORT FALSE: the robot goes on, and only what waits is cleared."""
    bench = set_up(bench, cstopi_for_abort=False)
    start_moving(bench)
    bench.pulse("rsr3", 0.1)
    bench.pulse("cstopi", 0.03)
    assert bench.now.program_state is RUNNING and bench.moving
    bench.run_until(lambda now: now.program_state is ABORTED)
    bench.run(0.5)
    assert bench.now.program_name == "ARTICLE" and not bench.moving, "RSR3 was cleared"


@pytest.mark.parametrize("name", ["hold", "enbl"])
@pytest.mark.parametrize("for_abort", [True, False])
def test_hold_stops_whatever_is_set_for_cstopi(bench: Bench, name: str, for_abort: bool) -> None:
    """*HOLD or ENBL off decelerates and pauses on every robot."""
    bench = set_up(bench, cstopi_for_abort=for_abort, imstp_assigned=False)
    start_moving(bench)
    bench.controller.write_input(name, False)
    bench.run(0.3)
    assert bench.now.program_state is PAUSED and not bench.moving


def test_hold_in_a_wait_keeps_the_next_move_from_beginning(bench: Bench) -> None:
    """Also once *HOLD is back on: a paused program wants START."""
    bench.pulse("panel_run2")
    bench.run_until(lambda now: now.program_line == WAIT_LINE)
    bench.run(0.2)
    assert not bench.moving
    stood = bench.now.positions
    bench.controller.write_input("hold", False)
    bench.run(2.0)
    bench.controller.write_input("hold", True)
    bench.run(1.0)
    assert bench.now.positions == stood and bench.now.program_state is PAUSED
    bench.pulse("start")
    bench.run(1.0)
    assert bench.now.positions != stood


def test_requests_wait_for_the_end_of_the_program_that_runs(bench: Bench) -> None:
    """They start one after the other, in their order."""
    bench.pulse("rsr2")
    bench.pulse("rsr3")
    bench.pulse("rsr2")
    assert bench.now.program_name == "ARTICLE" and bench.now.alarm is None
    names = []
    bench.run_until(
        lambda now: (
            ((names and names[-1] == now.program_name) or names.append(now.program_name))
            and len(names) == 3
        )
    )
    assert names == ["ARTICLE", "TWO_POINT", "ARTICLE"]


def test_a_request_while_a_program_is_paused_waits_too(bench: Bench) -> None:
    """It starts when the paused one has been resumed and has ended by itself."""
    start_moving(bench)
    bench.controller.write_input("hold", False)
    bench.run(0.3)
    bench.pulse("rsr3")
    bench.controller.write_input("hold", True)
    bench.run(1.0)
    assert bench.now.program_name == "ARTICLE" and bench.now.program_state is PAUSED
    bench.pulse("start")
    bench.run_until(lambda now: now.program_name == "TWO_POINT")


@pytest.mark.parametrize("key", ["cstopi", "panel_abort"])
def test_whoever_ends_a_program_clears_what_waits(bench: Bench, key: str) -> None:
    """A forced end is no end after which a request starts."""
    start_moving(bench)
    bench.pulse("rsr3")
    bench.pulse(key)
    bench.run(2.0)
    assert bench.now.program_state is ABORTED and bench.now.program_name == "ARTICLE"


def test_an_rsr_is_taken_at_its_rising_edge(bench: Bench) -> None:
    """PROGRUN comes within 35 ms of it, and how long it is on afterwards does not matter."""
    bench.controller.write_input("rsr2", True)
    bench.run(0.035)
    assert bench.now.outputs.progrun
    bench.controller.write_input("rsr2", False)
    bench.run(0.2)
    assert bench.now.outputs.progrun


@pytest.mark.parametrize("name", ["start", "prod_start"])
def test_a_short_pulse_starts_nothing(bench: Bench, name: str) -> None:
    """Measured by the robot's own clock: 90 ms are too short, 100 ms are enough."""
    start_moving(bench)
    bench.pulse("panel_abort" if name == "prod_start" else "panel_run2")
    bench.controller.write_input("hold", False)
    bench.run(0.5)
    bench.controller.write_input("hold", True)
    bench.pulse(name, 0.09)
    bench.run(0.3)
    assert bench.now.program_state is not RUNNING
    bench.pulse(name, 0.1)
    bench.run(0.1)
    assert bench.now.program_state is RUNNING


@pytest.mark.parametrize("only_continues", [True, False])
def test_start_without_a_paused_program_obeys_its_setting(
    bench: Bench, only_continues: bool
) -> None:
    """START for CONTINUE only TRUE: nothing. FALSE: the selected program, where it stands."""
    bench = set_up(bench, start_for_continue=only_continues)
    start_moving(bench)
    line = bench.now.program_line
    bench.pulse("cstopi")
    bench.run(0.5)
    bench.pulse("start")
    if only_continues:
        assert bench.now.program_state is ABORTED
    else:
        assert bench.now.program_state is RUNNING
        assert bench.now.program_line == line, "it begins where the cursor stands"


def test_start_with_nothing_selected_says_so(bench: Bench) -> None:
    """After power-up no program is selected."""
    bench = set_up(bench, start_for_continue=False)
    bench.pulse("start")
    assert bench.now.alarm is not None
    assert (bench.now.alarm.code, bench.now.alarm.cause) == (
        alarms.START_REFUSED,
        "no program is selected",
    )


def test_prod_start_begins_the_selected_program_at_its_first_line(bench: Bench) -> None:
    """Not while one runs or is paused."""
    start_moving(bench)
    bench.pulse("cstopi")
    bench.run(0.5)
    bench.pulse("prod_start")
    assert bench.now.program_state is RUNNING and bench.now.program_line == 1


def test_imstp_pauses_and_a_resumed_program_finishes_its_move(bench: Bench) -> None:
    """A servo alarm pauses: after RESET and START the robot goes on to the same point."""
    start_moving(bench)
    bench.controller.write_input("imstp", False)
    bench.run(0.5)
    assert bench.now.program_state is PAUSED and not bench.moving
    bench.controller.write_input("imstp", True)
    bench.pulse("fault_reset")
    bench.run(0.5)
    stood = bench.now.positions
    assert bench.now.program_state is PAUSED, "RESET moves nothing"
    bench.pulse("start")
    bench.run_until(lambda now: now.program_line == WAIT_LINE)
    bench.run(0.2)
    assert bench.now.positions[1] == pytest.approx(1.2147498, abs=1e-4) != stood[1]


def test_simple_allocation_is_the_makers_table(bench: Bench) -> None:
    """*IMSTP does nothing, RESET ends the program, START selects by PNS and starts."""
    bench = set_up(bench, uop="simple", start_for_continue=False)
    bench.controller.write_input("rsr2", True)
    bench.pulse("start")
    bench.controller.write_input("rsr2", False)
    assert bench.now.program_name == "ARTICLE" and bench.now.program_state is RUNNING
    bench.run(1.0)
    bench.controller.write_input("imstp", False)
    bench.run(0.1)
    assert bench.now.alarm is None and bench.now.program_state is RUNNING
    lit = [k + 1 for k, name in enumerate(UO) if getattr(bench.now.outputs, name)]
    assert lit == [1, 10], "CMDENBL and BUSY; no SYSRDY, no PROGRUN"
    bench.pulse("fault_reset")
    bench.run(0.5)
    assert bench.now.program_state is ABORTED and not bench.moving


def test_simple_allocation_starts_nothing_where_start_only_continues(bench: Bench) -> None:
    """The maker's note 5: nothing can be started from outside then."""
    bench = set_up(bench, uop="simple")
    bench.controller.write_input("rsr2", True)
    bench.pulse("start")
    bench.run(0.3)
    assert bench.now.program_state is ABORTED


def test_without_allocation_the_pendant_alone_has_an_effect(bench: Bench) -> None:
    """No signal stops the program, no output lights; ABORT at the pendant ends it."""
    bench = set_up(bench, uop="none")
    bench.pulse("rsr2")
    assert bench.now.program_state is ABORTED
    start_moving(bench)
    for name, level in (("hold", False), ("imstp", False), ("enbl", False), ("cstopi", True)):
        bench.controller.write_input(name, level)
    bench.run(0.2)
    assert bench.now.program_state is RUNNING and bench.moving
    assert not any(getattr(bench.now.outputs, name) for name in UO)
    bench.pulse("panel_abort")
    bench.run(0.5)
    assert bench.now.program_state is ABORTED and not bench.moving
