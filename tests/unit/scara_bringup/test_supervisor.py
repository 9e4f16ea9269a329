"""The supervisor's decisions: what is started, said and ended, without a single process."""

from __future__ import annotations

import signal

import pytest
from hypothesis import given
from hypothesis import strategies as st
from scara_bringup.config import Bringup
from scara_bringup.plan import MASTER, NodePlan
from scara_bringup.readiness import Missing
from scara_bringup.supervisor import (
    Announce,
    Cell,
    Checked,
    Event,
    Explain,
    Interrupted,
    Phase,
    ProcessEnded,
    SendSignal,
    StartNode,
    TimePassed,
    begin,
    describe_exit,
    step,
)

DEADLINES = Bringup(
    master_timeout=1.0,
    ready_timeout=30.0,
    check_period=0.1,
    interrupt_grace=5.0,
    terminate_grace=2.0,
    kill_grace=1.0,
    log_lines=10,
    log_limit_mb=1.0,
)
CONTROLLER = NodePlan("twin_controller", "p", "twin_controller", leaves=1)
RECORDER = NodePlan("recorder", "p", "recorder", leaves=2)
SIMULATOR = NodePlan("simulator", "p", "simulator")
GATEWAY = NodePlan("gateway", "p", "gateway")
LINK = NodePlan("farm_link", "farm", "link", leaves=0, optional=True)
RUN = NodePlan("run_experiment", "p", "run_experiment", leaves=0)
NODES = [SIMULATOR, GATEWAY, RECORDER, CONTROLLER]


def started(foreground: NodePlan | None = None, own_master: bool = True) -> Cell:
    """Return a cell that has begun at 0 s."""
    return begin(NODES, foreground, DEADLINES, 0.0, (MASTER,) if own_master else ())[0]


def running(foreground: NodePlan | None = None) -> Cell:
    """Return a cell that is ready at 1 s."""
    return step(started(foreground), Checked(()), 1.0)[0]


def end_in_order(cell: Cell, now: float) -> tuple[Cell, list[frozenset[str]]]:
    """Let every process obey its first SIGINT.

    Return the groups in the order in which they were signalled.
    """
    groups: list[frozenset[str]] = []
    cell, actions = step(cell, Interrupted(signal.SIGINT), now)
    while cell.phase is not Phase.ENDED:
        signals = [action for action in actions if isinstance(action, SendSignal)]
        assert [action.number for action in signals] == [signal.SIGINT], (
            "exactly one group is asked at a time"
        )
        groups.append(signals[0].names)
        actions = []
        for name in sorted(signals[0].names):
            cell, more = step(cell, ProcessEnded(name, 0), now)
            actions += more
    return cell, groups


def test_begin_starts_every_node_but_the_master_that_runs() -> None:
    """All nodes start at once: any order works."""
    cell, actions = begin(NODES, None, DEADLINES, 0.0, (MASTER,))
    assert actions == [StartNode(node) for node in NODES]
    assert cell.alive == {"simulator", "gateway", "recorder", "twin_controller", "rosmaster"}


def test_ready_cell_is_announced_once() -> None:
    """Looks after the first complete one change nothing."""
    cell, actions = step(started(), Checked(()), 1.0)
    assert (cell.phase, actions) == (Phase.RUNNING, [Announce()])
    assert step(cell, Checked(()), 2.0) == (cell, [])


def test_foreground_starts_only_when_the_cell_is_ready() -> None:
    """The experiments never meet a half-started cell."""
    cell, actions = step(started(RUN), Checked((Missing("gateway", "a listener"),)), 1.0)
    assert actions == []
    cell, actions = step(cell, Checked(()), 2.0)
    assert actions == [Announce(), StartNode(RUN)]


def test_cell_that_is_not_ready_in_time_names_what_is_missing() -> None:
    """The text names node and thing; the logs of those nodes are shown; the exit code is 1."""
    cell, _ = step(started(), Checked((Missing("gateway", "a listener at port 9090"),)), 29.0)
    cell, actions = step(cell, TimePassed(), 30.0)
    explain = actions[0]
    assert isinstance(explain, Explain)
    assert "not ready after 30 s" in explain.text
    assert "gateway: a listener at port 9090" in explain.text
    assert explain.logs == ("gateway",)
    assert (cell.phase, cell.exit_code) == (Phase.ENDING, 1)


@pytest.mark.parametrize(
    ("code", "exit_code", "text"),
    [(2, 2, "exit code 2"), (0, 1, "exit code 0"), (-9, 137, "SIGKILL"), (-11, 139, "SIGSEGV")],
)
@pytest.mark.parametrize("ready", [False, True])
def test_a_node_that_dies_is_named_and_ends_the_cell(
    code: int, exit_code: int, text: str, ready: bool
) -> None:
    """Even an exit code of 0 is a fault: a node has no business to end."""
    cell, actions = step(running() if ready else started(), ProcessEnded("simulator", code), 3.0)
    explain = actions[0]
    assert isinstance(explain, Explain)
    assert "simulator" in explain.text and text in explain.text and explain.logs == ("simulator",)
    assert (cell.phase, cell.exit_code) == (Phase.ENDING, exit_code)


@pytest.mark.parametrize(
    ("code", "exit_code", "told"), [(0, 0, False), (3, 3, True), (-15, 143, True)]
)
def test_end_of_the_foreground_ends_the_cell_with_its_code(
    code: int, exit_code: int, told: bool
) -> None:
    """A demo ends by itself; a failed experiment is the demo's failure."""
    cell, actions = step(running(RUN), ProcessEnded("run_experiment", code), 50.0)
    assert any(isinstance(action, Explain) for action in actions) is told
    assert (cell.phase, cell.exit_code) == (Phase.ENDING, exit_code)


def test_controller_leaves_first_then_recorder_then_the_others_then_the_master() -> None:
    """The controller disarms the watchdog while the robot is there; the recorder sees it."""
    cell, groups = end_in_order(running(), 5.0)
    assert groups == [
        frozenset({"twin_controller"}),
        frozenset({"recorder"}),
        frozenset({"simulator", "gateway"}),
        frozenset({"rosmaster"}),
    ]
    assert cell.exit_code == 130


def test_running_experiment_leaves_before_the_controller() -> None:
    """Nothing commands a cell that is being taken down."""
    _, groups = end_in_order(running(RUN), 5.0)
    assert groups[:2] == [frozenset({"run_experiment"}), frozenset({"twin_controller"})]


def test_foreign_master_is_left_alone() -> None:
    """A master that was there before the cell is there after it."""
    _, groups = end_in_order(step(started(own_master=False), Checked(()), 1.0)[0], 5.0)
    assert not any("rosmaster" in group for group in groups)


def test_process_that_ignores_signals_gets_harder_ones_after_each_grace() -> None:
    """SIGINT, after 5 s SIGTERM, after 2 s more SIGKILL."""
    cell, actions = step(running(), Interrupted(signal.SIGTERM), 10.0)
    seen = []
    for now in (14.9, 15.0, 16.9, 17.0):
        cell, actions = step(cell, TimePassed(), now)
        seen.append([action.number for action in actions if isinstance(action, SendSignal)])
    assert seen == [[], [signal.SIGTERM], [], [signal.SIGKILL]]
    cell, actions = step(cell, ProcessEnded("twin_controller", -9), 17.1)
    assert actions == [SendSignal(frozenset({"recorder"}), signal.SIGINT)], (
        "the next group starts gently again"
    )


def test_process_that_survives_sigkill_is_named_and_does_not_hang_the_end() -> None:
    """A process stuck in the kernel is told, not waited for."""
    cell = running()
    now = 10.0
    cell, actions = step(cell, Interrupted(signal.SIGINT), now)
    while cell.phase is Phase.ENDING:
        now += 1.0
        cell, actions = step(cell, TimePassed(), now)
    assert any(
        isinstance(action, Explain) and "not even by SIGKILL" in action.text for action in actions
    )
    assert now <= 10.0 + 5.0 + 2.0 + 1.0 + 1.0


def test_second_interrupt_kills_everything_at_once() -> None:
    """Who presses Ctrl-C twice does not want to wait."""
    cell, _ = step(running(RUN), Interrupted(signal.SIGINT), 10.0)
    cell, actions = step(cell, Interrupted(signal.SIGINT), 10.1)
    signals = [action for action in actions if isinstance(action, SendSignal)]
    assert signals == [SendSignal(cell.alive, signal.SIGKILL)]
    assert {"run_experiment", "twin_controller", "rosmaster"} <= cell.alive


@pytest.mark.parametrize("first", [signal.SIGHUP, signal.SIGTERM])
def test_closed_terminal_or_logout_ends_the_cell_in_order(first: signal.Signals) -> None:
    """Both send two signals at once, and no person has lost patience."""
    cell, _ = step(running(), Interrupted(first), 10.0)
    assert step(cell, Interrupted(signal.SIGHUP), 10.1) == (cell, [])


def test_node_that_dies_beside_the_first_is_named_too() -> None:
    """The first to be noticed need not be the cause."""
    cell, _ = step(running(), ProcessEnded("simulator", 1), 5.0)
    cell, actions = step(cell, ProcessEnded("gateway", 7), 5.0)
    assert any(
        isinstance(action, Explain) and "gateway ended with exit code 7 as well" in action.text
        for action in actions
    )
    assert cell.exit_code == 1


def test_node_that_obeys_is_not_called_dead() -> None:
    """The end that was asked for is no fault."""
    cell, _ = step(running(), Interrupted(signal.SIGINT), 5.0)
    _, actions = step(cell, ProcessEnded("twin_controller", 0), 5.2)
    assert not any(isinstance(action, Explain) for action in actions)


EVENTS = st.one_of(
    st.builds(
        ProcessEnded,
        st.sampled_from([node.name for node in [*NODES, RUN, MASTER]]),
        st.integers(-15, 3),
    ),
    st.just(Checked(())),
    st.just(Checked((Missing("gateway", "x"),))),
    st.builds(Interrupted, st.sampled_from([signal.SIGINT, signal.SIGTERM, signal.SIGHUP])),
    st.just(TimePassed()),
)


@given(st.lists(EVENTS, max_size=30))
def test_every_history_ends_and_every_living_process_is_killed_on_the_way(
    events: list[Event],
) -> None:
    """A signal and time always bring the cell to its end, and nobody alive is forgotten."""
    cell, now = started(RUN), 0.0
    killed: set[str] = set()

    def advance(event: Event) -> None:
        nonlocal cell, now
        now += 0.01 if isinstance(event, ProcessEnded) else 0.5
        cell, actions = step(cell, event, now)
        for action in actions:
            if isinstance(action, SendSignal) and action.number == signal.SIGKILL:
                killed.update(action.names)

    for event in [*events, Interrupted(signal.SIGINT)]:
        advance(event)
    for _ in range(200):
        if cell.phase is Phase.ENDED:
            break
        stubborn = sorted(cell.order[0] & cell.alive)[0]
        advance(ProcessEnded(stubborn, -9) if stubborn in killed else TimePassed())
    assert cell.phase is Phase.ENDED
    assert cell.alive <= killed, "who has not ended was killed"


@pytest.mark.parametrize(
    ("code", "text"), [(0, "exit code 0"), (5, "exit code 5"), (-15, "SIGTERM"), (-99, "signal 99")]
)
def test_exit_is_described_in_words(code: int, text: str) -> None:
    """Signals have names, and a number without one is still told."""
    assert text in describe_exit(code)


@pytest.mark.parametrize("code", [0, 1, -9])
def test_cell_goes_on_without_what_it_can_do_without(code: int) -> None:
    """Before it is ready and after; it is said, the others are not touched, and it ends well."""
    cell = begin([*NODES, LINK], None, DEADLINES, 0.0)[0]
    starting, actions = step(cell, ProcessEnded(LINK.name, code), 0.5)
    assert starting.phase is Phase.STARTING and LINK not in starting.nodes
    assert [type(action) for action in actions] == [Explain]
    assert "the cell goes on without it" in actions[0].text  # type: ignore[union-attr]
    cell = step(cell, Checked(()), 1.0)[0]
    cell, _ = step(cell, ProcessEnded(LINK.name, code), 2.0)
    assert (cell.phase, cell.exit_code) == (Phase.RUNNING, 0)
    cell, _ = step(cell, ProcessEnded(GATEWAY.name, 3), 3.0)
    assert (cell.phase, cell.exit_code) == (Phase.ENDING, 3)
