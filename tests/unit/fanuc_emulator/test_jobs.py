"""A start at the pendant while the client's stream program runs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from fanuc_emulator.controller import Controller
from fanuc_emulator.program_files_io import ProgramFiles
from fanuc_emulator.tp.executor import ProgramState
from harness.yaml_files import copy_configuration
from scara_config import ConfigError
from scara_config.programs.files import Taught
from scara_config.programs.keeping import keep_program
from scara_config.programs.tp.execution import flow_of
from scara_config.programs.tp.lines import read_line
from scara_config.programs.tp.listing import Indexed, Program

from fanuc_emulator import alarms

if TYPE_CHECKING:
    from unit.fanuc_emulator.conftest import Bench

TWO_POINT = "panel_run3"


@pytest.fixture
def streaming(bench: Bench) -> Bench:
    """Return a robot at rest whose stream program runs."""
    bench.stream_to("joint_1", 0.01)
    bench.pulse("rsr1")
    bench.run(1.0)
    program = bench.now.program_name
    assert bench.now.program_state is ProgramState.RUNNING and program == "RSR0101"
    return bench


def begun(bench: Bench) -> bool:
    """Return whether a program of the robot's own runs."""
    running = bench.now.program_state is ProgramState.RUNNING
    return running and bench.now.program_name not in ("", "RSR0101")


def test_a_start_at_the_pendant_waits_for_the_end_of_the_stream(streaming: Bench) -> None:
    """CSTOPI, by which the client ends its stream, does not clear it."""
    streaming.pulse(TWO_POINT)
    assert not begun(streaming) and streaming.now.alarm is None
    streaming.pulse("cstopi")
    streaming.run(0.2)
    assert begun(streaming) and streaming.now.alarm is None


@pytest.mark.parametrize("name", ["hold", "panel_hold", "enbl", "imstp", "panel_imstp"])
def test_whoever_holds_the_robot_clears_it(streaming: Bench, name: str) -> None:
    """What was asked for before a stop never begins after it."""
    streaming.pulse(TWO_POINT)
    streaming.controller.write_input(name, False)
    streaming.pulse("cstopi")
    streaming.controller.write_input(name, True)
    streaming.pulse("fault_reset")
    streaming.run(2.0)
    assert not begun(streaming) and streaming.now.program_state is ProgramState.ABORTED


def test_an_abort_at_the_pendant_clears_it(streaming: Bench) -> None:
    """The person has thought better of it."""
    streaming.pulse(TWO_POINT)
    streaming.pulse("panel_abort")
    streaming.run(2.0)
    assert not begun(streaming)


def test_a_stream_that_goes_on_refuses_it_in_the_end(streaming: Bench) -> None:
    """Nobody is surprised by a program that begins long after the key was pressed."""
    streaming.pulse(TWO_POINT)
    streaming.run(streaming.config.start_wait_ms * 1e-3 + 0.01)
    alarm = streaming.now.alarm
    assert alarm is not None and alarm.code is alarms.START_REFUSED
    assert alarm.cause == "RSR0101 is running"
    streaming.pulse("cstopi")
    streaming.run(2.0)
    assert not begun(streaming)


def test_program_saved_while_another_runs_is_there_at_the_next_start(
    bench: Bench, tmp_path: Path
) -> None:
    """The one that runs ends as it began; a wrong file changes nothing and is said once."""
    config = copy_configuration(tmp_path)
    files = ProgramFiles(bench.robot, config)
    assert files.newer() is None
    text = (config / "programs" / "TWO_POINT.LS").read_text(encoding="utf-8")
    keep_program("MINE", text.replace("TWO_POINT", "MINE"), config)
    newer = files.newer()
    assert newer is not None and files.newer() is None
    bench.pulse(TWO_POINT)
    bench.run(0.5)
    bench.controller.take_programs({})
    bench.run(0.5)
    assert (bench.now.program_name, bench.now.program_state) == ("TWO_POINT", ProgramState.RUNNING)
    bench.controller.take_programs(*newer)
    bench.pulse("panel_abort")
    bench.run(0.5)
    bench.pulse(f"panel_run{max(newer[0])}")
    bench.run(0.5)
    assert bench.now.program_name == "MINE" and begun(bench)
    (config / "programs" / "MINE.LS").write_text("/PROG MINE\n/MN\n 1: NONSENSE ;\n/END\n")
    with pytest.raises(ConfigError, match="NONSENSE"):
        files.newer()
    assert files.newer() is None


def test_a_program_without_a_number_can_be_called(bench: Bench) -> None:
    """As the judge takes it: its file is enough."""
    caller, other = [
        Taught(flow_of(Program(name, (read_line(line),)), name), {})
        for name, line in (("CALLER", "CALL OTHER"), ("OTHER", "R[60]=7"))
    ]
    library = {"OTHER": other}
    controller = Controller(bench.config, bench.robot, {2: caller}, 1.7e9, library=library)
    controller.pulse_input("panel_run2")
    for _ in range(50):
        controller.step()
    assert controller.registers.read(Indexed("R", (60.0,))) == 7.0
