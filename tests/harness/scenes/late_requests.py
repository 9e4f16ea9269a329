"""Requests and one STOP on their ways through nodes that stand still, in virtual time.

The nodes' ways are modelled here, message by message; what they decide is decided by the same code:
the motion nodes' ``Epoch``, the core's ``end_epoch`` and ``cancelled``, and ``Standstill``.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from scara_control.motion.commands import Command, MotionRefusedError
from scara_control.motion.epoch import AskedAt, Epoch
from scara_ros.standstill import Standstill, said
from twin_controller.core.lead.state import Lead, cancelled, end_epoch

STEP_S = 0.001
WIRE_S = 0.003
"""A message is on its way for so long at most."""
WORK_S = 0.05
"""What takes its time: a token's disk, kinematics, the judge."""
NODES = (
    "gateway",
    "twin_controller",
    "motion_server",
    "joint_pose_controller",
    "joint_vel_controller",
    "trajectory_server",
)
STALLED = tuple(name for name in NODES if name != "joint_vel_controller")
KINDS = ("MOVE", "MOVE_JOINTS", "move_to", "joint move", "goal", "jog", "set points", "target")
BY_WEB = ("MOVE", "MOVE_JOINTS", "move_to", "jog", "joint move")
"""What clients of the gateway ask for too."""
UNSTAMPED = ("MOVE", "MOVE_JOINTS", "move_to", "joint move", "jog", "target")
"""What somebody may send without saying when."""
Handle = Callable[[float], None]


@dataclass
class Begun:
    """A motion that a node has begun."""

    kind: str
    node: str
    sent: float
    at: float


@dataclass
class Node:
    """A process: what came for it, and when it does not run."""

    name: str
    period: float
    stalls: Sequence[tuple[float, float]]
    rng: random.Random
    epoch: Epoch
    inbox: list[tuple[float, int, bool, Handle]] = field(default_factory=list)
    due: float = 0.0

    def deliver(self, at: float, handle: Handle, *, stop: bool = False) -> None:
        """Let something come in at a time."""
        self.inbox.append((at, len(self.inbox), stop, handle))

    def step(self, now: float) -> None:
        """Do what has come, if the process runs now."""
        if any(begin <= now < end for begin, end in self.stalls):
            return
        there = [one for one in self.inbox if one[0] <= now]
        if not there and now < self.due:
            return
        self.due = now + self.period
        if self.epoch.ran(now):
            # Nobody knows their order: the stops are let go first, the rest goes as it likes.
            there.sort(key=lambda one: (not one[2], self.rng.random()))
        for one in there:
            self.inbox.remove(one)
        for one in there:
            one[3](now)


class Schedule:
    """One world: nodes, requests, a STOP, and what has begun."""

    def __init__(self, seed: int) -> None:
        """Draw when which node stands still."""
        self.rng = random.Random(seed)
        self.now = 10.0
        self.nodes = {name: self._node(name) for name in NODES}
        self._standing = {name: Standstill(self.now) for name in ("gateway", "twin_controller")}
        self.lead = Lead()
        self.begun: list[Begun] = []
        self.refused: list[str] = []
        self.acknowledged = self.passed_on = float("inf")

    def _node(self, name: str) -> Node:
        stalls = []
        for _ in range(self.rng.choice((0, 1, 1, 2)) if name in STALLED else 0):
            begin = self.now + self.rng.uniform(0.1, 1.0)
            stalls.append((begin, begin + self.rng.uniform(0.0, 1.0)))
        # At work, at rest, and at rest without a word: motion/idle_node.py.
        period = self.rng.choice((0.01, 0.05, 0.1)) if name != "twin_controller" else 0.01
        return Node(name, period, stalls, self.rng, Epoch(self.now))

    def run(self, until: float) -> None:
        """Let time pass."""
        while self.now < until:
            self.now += STEP_S
            for node in self.nodes.values():
                node.step(self.now)

    def send(self, kind: str, at: float, *, stamped: bool, web: bool) -> None:
        """Let somebody ask for a motion at a time."""
        if web:
            self._to("gateway", at, lambda now: self._read(kind, at, now))
            return
        self._ask(kind, at, at if stamped else 0.0, at)

    def stop(self, at: float) -> None:
        """Let somebody call ``twin_controller/command`` with STOP."""

        def hear(now: float) -> None:
            self.lead = end_epoch(self.lead, "STOP", now)
            self.acknowledged = now
            self._to("gateway", now, lambda then: self._pass_on(now, then), stop=True)

        self._to("twin_controller", at, hear, stop=True)

    def _pass_on(self, given: float, now: float) -> None:
        self.passed_on = now
        for name in NODES[2:]:
            epoch = self.nodes[name].epoch
            self._to(
                name,
                now,
                lambda then, epoch=epoch: epoch.hear(Command.STOP, "test", given, then),
                stop=True,
            )

    def _to(self, name: str, now: float, handle: Handle, *, stop: bool = False) -> None:
        self.nodes[name].deliver(now + self.rng.uniform(0.0, WIRE_S), handle, stop=stop)

    def _works(self, name: str, now: float, then: Handle) -> None:
        """Go on once something has taken its time."""
        self.nodes[name].deliver(now + self.rng.uniform(0.0, WORK_S), then)

    def _earliest(self, name: str, now: float) -> float:
        """Return when what ``name`` reads now may have come, by what its node knows."""
        return self.nodes[name].epoch.begin(0.0, now).at

    def _read(self, kind: str, sent: float, now: float) -> None:
        """Stamp a packet at the gateway."""
        self._ask(kind, sent, self._earliest("gateway", now), now)

    def _ask(self, kind: str, sent: float, asked: float, now: float) -> None:
        ways: dict[str, tuple[str, Callable[[float], None]]] = {
            "MOVE": ("twin_controller", lambda t: self._command("move_to", sent, asked, t)),
            "MOVE_JOINTS": (
                "twin_controller",
                lambda t: self._command("joint move", sent, asked, t),
            ),
            "move_to": ("motion_server", lambda t: self._move_to(sent, asked, t)),
            "joint move": ("joint_pose_controller", lambda t: self._judge(kind, sent, asked, t)),
            "target": ("joint_pose_controller", lambda t: self._judge(kind, sent, asked, t)),
            "goal": ("trajectory_server", lambda t: self._judge(kind, sent, asked, t)),
            "jog": ("joint_vel_controller", lambda t: self._jog(kind, sent, asked, t)),
            "set points": ("joint_pose_controller", lambda t: self._follow(sent, asked, t)),
        }
        name, handle = ways[kind]
        self._to(name, now, handle)

    def _command(self, then: str, sent: float, asked: float, now: float) -> None:
        """Take a command at the twin controller: the time first, the core behind a slow disk."""
        at = asked if said(asked, now) else self._earliest("twin_controller", now)

        def decide(later: float) -> None:
            why = cancelled(self.lead, at, later)
            if why:
                self.refused.append(why)
                return
            self.begun.append(Begun("core", "twin_controller", sent, later))
            self._to("gateway", later, lambda t: self._ask(then, sent, at, t))

        self._works("twin_controller", now, decide)

    def _taken(self, name: str, asked: float, now: float, stream: bool = False) -> AskedAt | None:
        try:
            return self.nodes[name].epoch.begin(asked, now, stream=stream)
        except MotionRefusedError as refused:
            self.refused.append(str(refused))
            return None

    def _checked(self, name: str, request: AskedAt) -> bool:
        try:
            self.nodes[name].epoch.check(request)
        except MotionRefusedError as refused:
            self.refused.append(str(refused))
            return False
        return True

    def _move_to(self, sent: float, asked: float, now: float) -> None:
        request = self._taken("motion_server", asked, now)
        if request is None:
            return

        def solved(later: float) -> None:
            if not self._checked("motion_server", request):
                return
            self._ask("joint move", sent, request.at, later)
            # Trimmed behind the move; the jog is as old as the request.
            self._works(
                "motion_server",
                later + 0.3,
                lambda t: (
                    self._ask("jog", sent, request.at, t)
                    if self._checked("motion_server", request)
                    else None
                ),
            )

        self._works("motion_server", now, solved)

    def _judge(self, kind: str, sent: float, asked: float, now: float) -> None:
        name = "trajectory_server" if kind == "goal" else "joint_pose_controller"
        request = self._taken(name, asked, now)
        if request is None:
            return

        def judged(later: float) -> None:
            if self._checked(name, request):
                self.begun.append(Begun(kind, name, sent, later))

        self._works(name, now, judged)

    def _jog(self, kind: str, sent: float, asked: float, now: float) -> None:
        if self._taken("joint_vel_controller", asked, now) is not None:
            self.begun.append(Begun(kind, "joint_vel_controller", sent, now))

    def _follow(self, sent: float, asked: float, now: float) -> None:
        if self._taken("joint_pose_controller", asked, now, stream=True) is not None:
            self.begun.append(Begun("set points", "joint_pose_controller", sent, now))
