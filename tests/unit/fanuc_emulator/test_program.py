"""Programs: moves, waits and states."""

import pytest
from fanuc_emulator.program import Executor, Program, ProgramState, StreamStep
from scara_config.programs.steps import MoveStep, WaitStep

MOVE = MoveStep(1, (0.0,), 50.0, True)
NEXT = MoveStep(2, (1.0,), 50.0, False)


def start(*steps: MoveStep | WaitStep | StreamStep, delay: float = 0.0) -> Executor:
    """Return an executor that runs the steps."""
    executor = Executor()
    executor.start(Program("TEST", tuple(steps)), delay)
    return executor


def test_first_step_waits_for_the_start_delay() -> None:
    """Nothing begins before the delay is over, counted in whole steps."""
    executor = start(MOVE, delay=0.006)
    assert [executor.advance(0.002, True, True) for _ in range(3)] == [None, None, MOVE]
    assert executor.step is MOVE


@pytest.mark.parametrize(
    ("step", "path_done", "arrived", "goes_on"),
    [
        (MOVE, False, False, False),
        (MOVE, True, False, False),
        (MOVE, True, True, True),
        (NEXT, False, False, False),
        (NEXT, True, False, True),
        (StreamStep(1), True, True, False),
    ],
)
def test_a_move_ends_by_its_termination_and_a_stream_never(
    step: MoveStep, path_done: bool, arrived: bool, goes_on: bool
) -> None:
    """FINE waits for the motors, CNT for the path only."""
    executor = start(step, MOVE)
    assert executor.advance(0.002, True, True) is step
    assert executor.advance(0.002, path_done, arrived) is (MOVE if goes_on else None)


def test_a_wait_lasts_its_time_and_the_program_ends_after_its_last_step() -> None:
    """After the last line the state is ABORTED, the line stays."""
    executor = start(WaitStep(1, 0.01), MOVE)
    started = [executor.advance(0.002, True, True) for _ in range(7)]
    assert started.index(MOVE) == 5
    assert executor.state is ProgramState.ABORTED
    assert executor.line == 1


def test_a_paused_program_stands_still_and_goes_on_where_it_was() -> None:
    """Pause freezes waits too; resume does not start anything anew."""
    executor = start(WaitStep(1, 0.004), NEXT)
    executor.advance(0.002, True, True)
    executor.pause()
    assert all(executor.advance(0.002, True, True) is None for _ in range(100))
    executor.resume()
    assert [executor.advance(0.002, True, True) for _ in range(2)] == [None, NEXT]


@pytest.mark.parametrize(
    ("before", "do", "after"),
    [
        ("running", "pause", ProgramState.PAUSED),
        ("running", "resume", ProgramState.RUNNING),
        ("running", "abort", ProgramState.ABORTED),
        ("paused", "pause", ProgramState.PAUSED),
        ("paused", "resume", ProgramState.RUNNING),
        ("paused", "abort", ProgramState.ABORTED),
        ("aborted", "pause", ProgramState.ABORTED),
        ("aborted", "resume", ProgramState.ABORTED),
        ("aborted", "abort", ProgramState.ABORTED),
    ],
)
def test_every_state_answers_every_command(before: str, do: str, after: ProgramState) -> None:
    """An ended program cannot be resumed."""
    executor = start(MOVE)
    if before != "running":
        getattr(executor, "pause" if before == "paused" else "abort")()
    getattr(executor, do)()
    assert executor.state is after


def test_before_the_first_program_there_is_no_line() -> None:
    """Line 0 and no step, so that a reader cannot take it for a running program."""
    executor = Executor()
    assert (executor.line, executor.step, executor.advance(0.002, True, True)) == (0, None, None)
