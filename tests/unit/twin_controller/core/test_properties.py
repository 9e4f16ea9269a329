"""The rules hold whatever both sides, their links and clocks and the operator do."""

from __future__ import annotations

import msgspec
import pytest
from harness.pair import HOME, SETUP, Pair, ramp, shifted
from harness.running.thorough import examples
from harness.watch import Watch
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, precondition, rule
from twin_controller.core.actions import AnyAction, Command
from twin_controller.core.events import AnyEvent
from twin_controller.core.lead.modes import COMMANDS, Mode
from twin_controller.core.orders.stop import STOPPING_TWIN
from twin_controller.core.state import initial_state
from twin_controller.core.step import step

ENCODER = msgspec.msgpack.Encoder()
DECODER = msgspec.msgpack.Decoder(AnyEvent)
OFFSETS = st.tuples(
    st.floats(-25.0, 25.0), st.floats(-35.0, 35.0), st.floats(-40.0, 90.0), st.floats(-15.0, 15.0)
)
TARGETS = OFFSETS.map(lambda border: shifted(HOME, *border))
SIDES = st.sampled_from(["real", "twin"])
TWIN_COMMANDS = (*STOPPING_TWIN, Command.RESUME_TWIN, Command.RESET_TWIN)


class Cell(RuleBasedStateMachine):
    """A pair, everything that can happen to it, and the rules it is held against."""

    @initialize(
        delays=st.sampled_from([(0.0, 0.0), (0.03, 0.02)]),
        off=st.booleans(),
        places=st.sampled_from([0, 10]),
    )
    def start(self, delays: tuple[float, float], off: bool, places: int) -> None:
        """Connect a pair, its commands and reports at once or late, its twin at home or away.

        Its real robot takes set points ahead of their time, or not.
        """
        self.pair = Pair(twin=shifted(HOME, 5.0) if off else HOME, places=places)
        self.pair.command_delay, self.pair.report_delay = delays
        Watch(self.pair)
        self.pair.connect()

    @rule(ms=st.sampled_from([10, 50, 200, 500, 1000]))
    def wait(self, ms: int) -> None:
        """Time passes."""
        self.pair.run(ms * 1e-3)

    @rule(command=st.sampled_from([*COMMANDS, "HOME", "MOVE", "DANCE"]))
    def operator_commands(self, command: str) -> None:
        """The operator gives a command."""
        self.pair.operate(command, target=(0.5, 0.1, 0.1) if command == "MOVE" else ())

    @rule(pose=TARGETS)
    def operator_moves(self, pose: tuple[float, ...]) -> None:
        """The operator moves both."""
        self.pair.operate("MOVE_JOINTS", target=pose)
        self.pair.run(0.3)

    @rule(pose=TARGETS, duration=st.floats(0.8, 3.0))
    def program_begins(self, pose: tuple[float, ...], duration: float) -> None:
        """A program is started on the real robot's own panel."""
        self.pair.start_program(ramp(self.pair.real_q, pose, duration))
        self.pair.run(0.3)

    @rule()
    def program_ends(self) -> None:
        """It ends."""
        self.pair.end_program()

    @precondition(lambda self: self.pair.drives and not self.pair.own_program)
    @rule(pose=TARGETS, duration=st.floats(0.8, 3.0))
    def real_is_jogged(self, pose: tuple[float, ...], duration: float) -> None:
        """The real robot moves without a program."""
        self.pair.jog_real(ramp(self.pair.real_q, pose, duration))

    @rule(pose=TARGETS, duration=st.floats(0.8, 3.0))
    def twin_moves(self, pose: tuple[float, ...], duration: float) -> None:
        """The twin moves by its pose controller."""
        self.pair.move_twin(ramp(self.pair.twin_q, pose, duration))
        self.pair.run(0.3)

    @precondition(lambda self: self.pair.motion == "idle")
    @rule(pose=TARGETS, duration=st.floats(0.8, 3.0))
    def twin_is_jogged(self, pose: tuple[float, ...], duration: float) -> None:
        """The twin moves unannounced."""
        self.pair.jog_twin(ramp(self.pair.twin_q, pose, duration), self.pair.now)

    @rule(do=st.sampled_from(TWIN_COMMANDS), number=st.sampled_from([0, 17, 18]))
    def twin_is_commanded(self, do: Command, number: int) -> None:
        """Somebody commands the twin on its side."""
        self.pair.order_twin(do, number)

    @precondition(lambda self: self.pair.own_program or self.pair.streaming)
    @rule()
    def real_is_held_or_released(self) -> None:
        """The pendant holds the robot, or lets it go on."""
        self.pair.paused = not self.pair.paused

    @rule()
    def emergency_stop_is_pressed_or_released(self) -> None:
        """The robot's own emergency stop; releasing it switches nothing on."""
        if self.pair.estop_pressed:
            self.pair.estop_pressed = False
        else:
            self.pair.press_estop()

    @rule()
    def alarm_comes_or_its_cause_goes(self) -> None:
        """An alarm that stops the robot."""
        if self.pair.fault_persists:
            self.pair.fault_persists = False
        else:
            self.pair.alarm("SRVO-050 collision")

    @rule(side=SIDES)
    def link_is_cut_or_mended(self, side: str) -> None:
        """A connection goes or comes; the real robot's own watchdog ends its stream."""
        self.pair.link(side, not getattr(self.pair, f"{side}_up"))
        if side == "real" and not self.pair.real_up:
            self.pair.streaming = False
            self.pair.setpoints.clear()

    @rule(side=SIDES, ms=st.sampled_from([60, 150, 400]))
    def side_is_silent(self, side: str, ms: int) -> None:
        """A half-open connection: nothing comes and nothing gets through."""
        was = getattr(self.pair, f"{side}_up")
        setattr(self.pair, f"{side}_up", False)
        self.pair.run(ms * 1e-3)
        setattr(self.pair, f"{side}_up", was)

    @rule(side=SIDES, jump=st.sampled_from([3600.0, -3600.0, 1.0, -1.0]))
    def clock_jumps(self, side: str, jump: float) -> None:
        """Somebody sets a clock."""
        setattr(self.pair, f"{side}_clock", getattr(self.pair, f"{side}_clock") + jump)

    @rule(side=SIDES, drift=st.sampled_from([200e-6, -200e-6, 0.0, -2.0, -1.0]))
    def clock_drifts(self, side: str, drift: float) -> None:
        """A clock is fast or slow, runs backwards, or stands."""
        setattr(self.pair, f"{side}_drift", drift)

    def teardown(self) -> None:
        """After all faults are mended the pair comes back, and the record replays alike."""
        if hasattr(self, "pair"):
            mend(self.pair)
            works_both_ways(self.pair)
            recorded = [DECODER.decode(ENCODER.encode(event)) for event in self.pair.inputs]
            assert recorded == self.pair.inputs
            assert replayed(recorded) == self.pair.actions


def mend(pair: Pair) -> None:
    """Take all causes of trouble away, do the operator's part, and wait for the pair to idle."""
    pair.real_drift = pair.twin_drift = 0.0
    pair.estop_pressed = pair.fault_persists = pair.paused = False
    pair.jog = None
    for side in ("real", "twin"):
        if not getattr(pair, f"{side}_up"):
            pair.link(side, True)
    pair.run(1.5)
    # One that was set back by less than a jump is so only after many readings that contradict it.
    pair.run_until(lambda: _clocks_agree(pair), 5.0)
    for _ in range(3):
        if pair.mode in (Mode.ESTOP, Mode.FAULT):
            assert pair.operate("RESET").success, pair.why
            pair.run(0.5)
    pair.do("STOP")
    pair.until(Mode.STOPPED, 5.0)  # a clock that stood or jumped is believed again by then
    assert pair.operate("ALIGN").success, pair.why
    pair.until(Mode.IDLE, 30.0)


def _clocks_agree(pair: Pair) -> bool:
    sides, lead = pair.state.sides, pair.state.lead
    sure = not any(side.clock.conflicts for side in (sides.real, sides.twin))
    return sure and sides.usable and lead.links_up


def works_both_ways(pair: Pair) -> None:
    """Let the real robot lead, then the twin; the other one follows to the same place."""
    away = shifted(pair.real_q, -2.0 if pair.real_q[0] > 0.0 else 2.0, 1.0)
    pair.start_program(ramp(pair.real_q, away, 1.0), run=0.5)
    assert pair.mode is Mode.REAL_LEADS, pair.why
    pair.run(0.6)
    pair.end_program()
    pair.until(Mode.IDLE, 5.0)
    assert pair.real_q == away and pair.far() <= SETUP.config.settle.tolerance
    pair.run(0.2)
    pair.move_twin(ramp(pair.twin_q, shifted(pair.twin_q, 1.0, -2.0), 1.0), run=0.6)
    assert pair.mode is Mode.TWIN_LEADS, pair.why
    pair.until(Mode.IDLE, 5.0)
    assert pair.real_q != away and pair.far() <= SETUP.config.settle.tolerance


def replayed(events: list[AnyEvent]) -> list[AnyAction]:
    """Return the core's actions on recorded inputs."""
    state, actions = initial_state(SETUP), []
    for event in events:
        state, done = step(SETUP, state, event)
        actions += done
    return actions


TestCell = pytest.mark.slow(Cell.TestCase)
TestCell.settings = settings(
    max_examples=examples(3, 40),
    stateful_step_count=10,
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow],
)
