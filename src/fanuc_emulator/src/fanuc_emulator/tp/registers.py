"""Registers and signals as the robot's programs see them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from scara_config.frames import NO_FRAMES, FrameTable
from scara_config.programs.tp.expressions import Cursor, operand
from scara_config.programs.tp.listing import Indexed, Name, PulseTime
from scara_config.programs.tp.printer import print_expression
from scara_config.programs.tp.values import (
    POSE_NUMBERS,
    ExecutionError,
    Memory,
    Pose,
    Value,
    Written,
    as_number,
)

from fanuc_emulator import alarms
from fanuc_emulator.alarms import RefusedError

HIGHEST = 200
"""Index of the last register [our]: as many as the stand-in shows."""
NUMBERS = ("R", "TIMER", "GI", "GO", "AI", "AO")
SIGNALS = ("F", "DI", "DO", "RI", "RO", "UI", "UO", "SI", "SO")
READ_ONLY = ("DI", "RI", "UI", "SI", "GI", "AI", "TIMER")
PULSE_S = 0.1
"""Of a pulse without a time [asm]."""
FRAMES = ("UFRAME", "UTOOL")
NO_SHIFT = Pose((0.0,) * POSE_NUMBERS, "")
"""A frame that was never set: the base, or the flange."""
SELECTED = ("UFRAME_NUM", "UTOOL_NUM", "$WAITTMOUT")
"""Names that are kept; which frame is selected does not matter to joint positions."""

Place = Indexed | Name


class RunClock:
    """Goes on only while one program runs: not while it is paused, and not behind its end.

    Attributes:
        seconds: For how long it has run [s].
    """

    def __init__(self) -> None:
        self.seconds = 0.0


class Registers:
    """What no program has set is 0 or OFF.

    Args:
        reads: What stands in places that belong to the controller, as a program names them.
        writes: What setting such a place does; one that is in ``reads`` alone cannot be set.
        now: The controller's own clock [s], which ends pulses.
        table: Frames that were taught.

    Attributes:
        locked: Tells whether LOCK PREG keeps the position registers as they are.
        clock: Of the program whose line is executed: it drives the timers that this line starts.
    """

    def __init__(
        self,
        reads: Mapping[str, Callable[[], Value]] | None = None,
        writes: Mapping[str, Callable[[Value], None]] | None = None,
        now: Callable[[], float] = lambda: 0.0,
        table: FrameTable = NO_FRAMES,
    ) -> None:
        self._now = now
        self.locked: Callable[[], bool] = lambda: False
        self.clock = RunClock()
        # Each timer is so far ahead of the clock that drives it [s]; None: it stands there.
        self._timers: dict[Place, tuple[float, RunClock | None]] = {}
        # Outputs that are the other way round for a while: until when, and how they were.
        self._pulses: dict[Place, tuple[float, bool]] = {}
        self._reads = {operand(Cursor(name)): read for name, read in (reads or {}).items()}
        self._writes = {operand(Cursor(name)): write for name, write in (writes or {}).items()}
        self._values: dict[Place, Value] = {Name("$WAITTMOUT"): 3000.0}
        for kind, frames in zip(FRAMES, (table.numbered("user"), table.numbered("tool"))):
            for number, frame in frames.items():
                values = (*frame.xyz_mm, *frame.wpr_deg, *(0.0,) * (POSE_NUMBERS - 6))
                self._values[Indexed(kind, (float(number),))] = Pose(values, "")
        # Those that hold numbers and were set by a program.
        self._numbers: set[Place] = set()

    def read(self, place: Place) -> Value:
        """Return what stands there.

        Raises:
            ExecutionError: The stand-in has no such place, or a position was never set.
        """
        # What was looked up before comes first: background logic reads a dozen in each period.
        found = self._values.get(place)
        if found is not None:
            return found
        read = self._reads.get(place)
        if read is not None:
            return read()
        if isinstance(place, Indexed) and place.kind == "PR":
            return self._element(place)
        self._check(place)
        if isinstance(place, Indexed) and place.kind == "TIMER":
            ahead, clock = self._timers.get(place, (0.0, None))
            return ahead if clock is None else ahead + clock.seconds
        if isinstance(place, Indexed) and place.kind in FRAMES:
            return NO_SHIFT
        signal = isinstance(place, Indexed) and place.kind in SIGNALS
        return self._values.setdefault(place, False if signal else 0.0)

    def write(self, place: Place, value: Written) -> None:
        """Set what stands there.

        Raises:
            ExecutionError: It cannot be set.
            RefusedError: It is a position register, and these are locked.
        """
        write = self._writes.get(place)
        if place in self._numbers and value.__class__ is float:
            # Set before, so it may be set: background logic counts in each period.
            self._values[place] = value
        elif isinstance(value, PulseTime):
            if not isinstance(place, Indexed) or place.kind not in ("DO", "RO"):
                raise ExecutionError(f"{print_expression(place)}: DO and RO have pulses")
            self._check(place)
            self._pulse(place, value)
        elif isinstance(value, Name):
            self._time(place, value.word)
        elif isinstance(place, Indexed) and place.kind == "PR" and self.locked():
            why = f"{print_expression(place)} cannot be set between LOCK PREG and UNLOCK PREG"
            raise RefusedError(alarms.PR_LOCKED, why)
        elif write is not None:
            write(value)
        elif isinstance(place, Indexed) and place.kind in ("PR", *FRAMES):
            self._set_position(place, value)
        else:
            self._set(place, value)

    def end_pulses(self) -> None:
        """Switch the outputs back whose time is over; in each period."""
        if not self._pulses:
            return
        for place, (until, before) in list(self._pulses.items()):
            # The clock is a product of ticks and may fall short of the end by rounding.
            if self._now() >= until - 1e-9:
                del self._pulses[place]
                self.write(place, before)

    def _pulse(self, place: Place, pulse: PulseTime) -> None:
        """Turn an output the other way round for a while.

        A pulse that comes while one lasts makes that one longer [our].

        Source:
            B-83284EN/09, sections 4.6.1, 4.6.2.
        """
        _, before = self._pulses.get(place, (0.0, bool(self.read(place))))
        self.write(place, not before)
        seconds = PULSE_S if pulse.seconds is None else pulse.seconds
        assert isinstance(seconds, float)
        self._pulses[place] = self._now() + seconds, before

    def _time(self, place: Place, word: str) -> None:
        """Start, stop or reset a timer; behind RESET a running one goes on from 0.

        Source:
            B-83284EN/09, sections 4.14.1, 7.9: a local timer stops while its program does.
        """
        if not isinstance(place, Indexed) or place.kind != "TIMER":
            raise ExecutionError(f"{print_expression(place)}: only a timer is set to {word}")
        self._check(place)
        counted = 0.0 if word == "RESET" else as_number(self.read(place))
        _, clock = self._timers.get(place, (0.0, None))
        if word != "RESET":
            clock = self.clock if word == "START" else None
        self._timers[place] = counted if clock is None else counted - clock.seconds, clock

    def _set(self, place: Place, value: Value) -> None:
        """Set a register or an output that belongs to no other part."""
        self._check(place)
        inputs = isinstance(place, Indexed) and place.kind in READ_ONLY
        if inputs or place in self._reads:
            raise ExecutionError(f"{print_expression(place)} cannot be set")
        if isinstance(value, Pose):
            raise ExecutionError(f"{print_expression(place)} holds no position")
        signal = isinstance(place, Indexed) and place.kind in SIGNALS
        self._values[place] = bool(value) if signal else float(value)
        if not signal:
            self._numbers.add(place)

    def _element(self, place: Indexed) -> float:
        """Return PR[i,j]."""
        if len(place.index) == 1:
            self._check(place)
            raise ExecutionError(f"{print_expression(place)} was never set")
        whole, at = _whole(place)
        found = self.read(whole)
        assert isinstance(found, Pose)
        return found.values[at]

    def _set_position(self, place: Indexed, value: Value) -> None:
        """Set PR[i] or PR[i,j]."""
        if len(place.index) == 1:
            self._check(place)
            if not isinstance(value, Pose):
                raise ExecutionError(f"{print_expression(place)} holds a position")
            if place.kind in FRAMES and value.config is None:
                raise ExecutionError(f"{print_expression(place)} holds no position in joints")
            self._values[place] = value
            return
        whole, at = _whole(place)
        found = self.read(whole)
        assert isinstance(found, Pose)
        values = (*found.values[:at], as_number(value), *found.values[at + 1 :])
        self.write(whole, Pose(values, found.config))

    def _check(self, place: Place) -> None:
        known = (
            place.word in SELECTED
            if isinstance(place, Name)
            else place.kind in (*NUMBERS, *SIGNALS, *FRAMES, "PR")
            and len(place.index) == 1
            and 1 <= float(place.index[0]) <= HIGHEST  # type: ignore[arg-type]
        )
        if not known:
            raise ExecutionError(f"the stand-in keeps no {print_expression(place)}")


def _whole(place: Indexed) -> tuple[Indexed, int]:
    """Return the position register of PR[i,j], and which of its numbers j is, from 0.

    Raises:
        ExecutionError: It has no such number.
    """
    index, element = place.index
    at = int(element) - 1  # type: ignore[arg-type]
    if not 0 <= at < POSE_NUMBERS:
        raise ExecutionError(f"{print_expression(place)}: a position has {POSE_NUMBERS} numbers")
    return Indexed("PR", (index,)), at


class ProgramRegisters:
    """Registers as a program sees them, with its arguments AR[n] and its positions P[n]."""

    def __init__(
        self, registers: Memory, arguments: Sequence[Value], poses: Mapping[int, Pose]
    ) -> None:
        self._registers, self._arguments, self._poses = registers, arguments, poses

    def read(self, place: Place) -> Value:
        """Return an argument, a position, or what stands in a register.

        Raises:
            ExecutionError: There is no such argument, position or place.
        """
        if not isinstance(place, Indexed) or place.kind not in ("AR", "P"):
            return self._registers.read(place)
        number = int(float(place.index[0]))  # type: ignore[arg-type]
        if place.kind == "P":
            if number not in self._poses:
                raise ExecutionError(f"P[{number}] is not taught")
            return self._poses[number]
        if not 1 <= number <= len(self._arguments):
            raise ExecutionError(f"AR[{number}]: {len(self._arguments)} arguments were given")
        return self._arguments[number - 1]

    def write(self, place: Place, value: Written) -> None:
        """Set a register.

        Raises:
            ExecutionError: It cannot be set.
        """
        self._registers.write(place, value)
