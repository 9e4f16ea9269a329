"""The thin shell around the supervisor: it starts, signals, looks and tells; it decides nothing."""

from __future__ import annotations

import os
import shlex
import signal
import threading
import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from scara_ros.pacing import Pace
from scara_ros.process.scheduling_io import may_go_first

from scara_bringup.config import Bringup, Doors
from scara_bringup.plan import CONTROLLER, MASTER, ROSOUT, NodePlan
from scara_bringup.processes.master_io import MasterAddress, MasterProbe
from scara_bringup.processes.ports_io import listening_ports
from scara_bringup.processes.preflight_io import CannotStartError, namespace
from scara_bringup.processes.processes_io import Processes
from scara_bringup.readiness import WORKS, SeenCell, missing
from scara_bringup.status.running_io import RunningCell, RunningNode, announced, birth_of
from scara_bringup.supervisor import (
    Action,
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
    step,
)
from scara_bringup.terminal import screen_io as screen
from scara_bringup.terminal.browser_io import open_page

if TYPE_CHECKING:
    from scara_bringup.processes.controller_watch_node import ControllerWatch

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
LOOP_PERIOD = 0.05
PATIENCE_PERIOD = 5.0
LOG_PERIOD = 10.0
MASTER_PATIENCE = 1.0  # our choice: a master that is well answers within milliseconds


@dataclass(frozen=True)
class Shown:
    """What a person is told of the cell.

    Attributes:
        verb: What was asked for.
        robot: Its name.
        plant: How its stand-in behaves; empty: it has none.
        browser: Whether the operator's page is opened where there is a display.
        runs: The folder of all recordings and journals.
        on_ready: Are called when the cell is ready.
        on_works: Are called when its pair has been aligned, which may need a person first.
    """

    verb: str
    robot: str
    plant: str
    browser: bool = False
    runs: str = ""
    on_ready: tuple[Callable[[], None], ...] = ()
    on_works: tuple[Callable[[], None], ...] = ()


class CellShell:
    """Carries out what the supervisor decides, and tells it what happens."""

    def __init__(
        self,
        processes: Processes,
        master: MasterProbe,
        deadlines: Bringup,
        doors: Doors,
        folder: Path,
        shown: Shown,
    ) -> None:
        """Take over the resources of one run."""
        self._processes = processes
        self._master = master
        self._deadlines = deadlines
        self._doors = doors
        self._folder = folder
        self._shown = shown
        self._announced = ExitStack()
        self._watch: ControllerWatch | None = None
        self._signals: list[int] = []
        self._began = time.monotonic()
        self._next_check = 0.0
        self._next_word = self._began + PATIENCE_PERIOD
        self._log_pace = Pace(LOG_PERIOD)
        self._foreground = ""
        self._works = False

    def run(self, nodes: list[NodePlan], foreground: NodePlan | None, own_master: bool) -> int:
        """Run the cell to its end and return the exit code."""
        with self._announced:
            return self._run(nodes, foreground, own_master)

    def _run(self, nodes: list[NodePlan], foreground: NodePlan | None, own_master: bool) -> int:
        """Start, watch and end the nodes."""
        for number in SIGNALS:
            # nohup has it ignored: the cell outlives its terminal.
            if number == signal.SIGHUP and signal.getsignal(number) == signal.SIG_IGN:
                continue
            # Only noted: a handler may come between any two steps of what it would change.
            signal.signal(number, lambda received, _frame: self._signals.append(received))
        screen.say(f"cell: starting {len(nodes)} nodes; logs: {self._processes.log_folder}")
        if not may_go_first():
            screen.say(
                "cell: this system gives the control loops no real-time priority: what else runs "
                "will disturb them (allowed: root, or `ulimit -r 10`)"
            )
        running: tuple[NodePlan, ...] = ()
        if own_master:
            # Start a ROS master and wait until it answers
            port = str(MasterAddress.of(self._master.uri).port)
            self._processes.start(replace(MASTER, arguments=("--core", "-p", port)))
            deadline = time.monotonic() + self._deadlines.master_timeout
            while not self._master.answers():
                if self._signals:
                    raise CannotStartError("interrupted")
                if self._processes.ended() or time.monotonic() > deadline:
                    lines = self._processes.last_lines(MASTER.name, self._deadlines.log_lines)
                    raise CannotStartError(
                        f"the ROS master at {self._master.uri} did not start:\n" + "\n".join(lines)
                    )
                time.sleep(LOOP_PERIOD)
            running, nodes = (MASTER,), [ROSOUT, *nodes]
        else:
            screen.say(f"cell: using the ROS master that runs at {self._master.uri}")
        self._foreground = foreground.name if foreground else ""
        cell, actions = begin(nodes, foreground, self._deadlines, time.monotonic(), running)
        self._perform(actions, cell)
        # Only now: it makes this process a node, which needs the master and has threads.
        from scara_bringup.processes.controller_watch_node import ControllerWatch

        self._watch = ControllerWatch()
        while cell.phase is not Phase.ENDED:
            for event in self._events(cell):
                cell, actions = step(cell, event, time.monotonic())
                self._perform(actions, cell)
            if cell.phase is Phase.RUNNING:
                self._look_at_pair(cell)
            # The nodes' output must not fill the disk.
            full = self._log_pace.is_due(time.monotonic()) and self._processes.limit_logs(
                self._deadlines.log_limit_mb
            )
            for log in full or ():
                screen.say(f"cell: {log} was full and begins anew; the one before it: {log.name}.1")
            time.sleep(LOOP_PERIOD)
        return cell.exit_code

    def _events(self, cell: Cell) -> list[Event]:
        """Collect what has happened since the last call."""
        events: list[Event] = [ProcessEnded(name, code) for name, code in self._processes.ended()]
        while self._signals:
            events.append(Interrupted(self._signals.pop(0)))
        now = time.monotonic()
        if cell.phase is Phase.STARTING and now >= self._next_check:
            self._next_check = now + self._deadlines.check_period
            services, topics = self._master.services_and_topics()
            mode, why = self._watch.last() if self._watch else ("", "")
            seen = SeenCell(services, topics, listening_ports(), mode, why)
            idle = bool(self._foreground)
            events.append(Checked(missing(cell.nodes, seen, namespace(), idle)))
        if cell.phase is Phase.STARTING and now >= self._next_word and cell.lacking:
            self._next_word = now + PATIENCE_PERIOD
            screen.say(
                "cell: waiting for "
                f"{'; '.join(f'{item.node}: {item.what}' for item in cell.lacking)}"
            )
        return [*events, TimePassed()]

    def _look_at_pair(self, cell: Cell) -> None:
        """Tell once that the pair works; a change is proven by that, not by a FAULT of its own."""
        if self._watch is None or self._works or self._not_working(cell):
            return
        self._works = True
        for tell in self._shown.on_works:
            tell()
        # Nobody needs the mode any longer.
        _tell_master(self._watch.rest)

    def _not_working(self, cell: Cell) -> str:
        """Return the mode and reason of a pair that does not work; empty: it does."""
        if self._watch is None or all(node.name != CONTROLLER for node in cell.nodes):
            return ""
        mode, why = self._watch.last()
        if mode in WORKS:
            return ""
        return f"{mode} ({why})" if why else mode

    def _perform(self, actions: list[Action], cell: Cell) -> None:
        """Carry out actions."""
        for action in actions:
            if isinstance(action, StartNode):
                self._processes.start(action.node, foreground=action.node.name == self._foreground)
            elif isinstance(action, SendSignal):
                if self._watch is not None:
                    # No longer a node before the nodes and their master end.
                    _tell_master(self._watch.close)
                    self._watch = None
                self._processes.signal(action.names, action.number)
            elif isinstance(action, Announce):
                self._announce(cell)
            elif isinstance(action, Explain):
                screen.complain(action.text)
                for name in action.logs:
                    lines = self._processes.last_lines(name, self._deadlines.log_lines)
                    screen.show_log(str(self._processes.log_of(name)), lines)

    def _announce(self, cell: Cell) -> None:
        """Tell that the cell is ready: to the person here, and to whoever asks for its status."""
        # Read once all are ready: each page has written its token by then.
        addresses = screen.page_addresses(self._doors, cell.nodes, self._folder)
        self._announced.enter_context(announced(self._running(cell, addresses)))
        for tell in self._shown.on_ready:
            tell()
        seconds = time.monotonic() - self._began
        if self._foreground:
            screen.say(f"cell: ready after {seconds:.1f} s")
            return
        trouble = self._not_working(cell)
        screen.show_cell(cell.nodes, addresses, self._master.uri, self._folder, seconds, trouble)
        if self._shown.browser and addresses:
            open_page(next(iter(addresses.values())), self._folder / "ros_home")

    def _running(self, cell: Cell, addresses: dict[str, str]) -> RunningCell:
        """Describe the cell to whoever asks for its status."""
        pids = self._processes.pids()
        nodes = [
            RunningNode(
                node.name,
                pids[node.name],
                shlex.join(("rosrun", node.package, node.executable, *node.arguments)),
                str(self._processes.log_of(node.name)),
            )
            for node in cell.nodes
            if node.name in pids
        ]
        doors = {
            "Twin's web socket": f"ws://{self._doors.gateway.host}:{self._doors.gateway.port}",
            "Robot's Modbus TCP": f"{self._doors.modbus.host}:{self._doors.modbus.port}",
        }
        return RunningCell(
            pid=os.getpid(),
            verb=self._shown.verb,
            robot=self._shown.robot,
            plant=self._shown.plant,
            master_uri=self._master.uri,
            namespace=namespace(),
            folder=str(self._folder),
            addresses={**addresses, **doors},
            nodes=nodes,
            runs=self._shown.runs,
            born=birth_of(os.getpid()),
        )


def _tell_master(leave: Callable[[], None]) -> None:
    """Leave the master, or a topic of it; one that hangs keeps nobody from being told to end."""
    leaving = threading.Thread(target=leave, daemon=True)
    leaving.start()
    leaving.join(MASTER_PATIENCE)
