"""Walk through a program without a robot: what it does, as long as no input decides that."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping

from scara_config.loader import ConfigError
from scara_config.programs.steps import GripperStep, MoveStep, Step, WaitStep
from scara_config.programs.tp.execution import Flow, execute
from scara_config.programs.tp.listing import (
    Indexed,
    Line,
    MotionLine,
    Name,
    Numbered,
    PulseTime,
    Wait,
    WaitUntil,
    Word,
)
from scara_config.programs.tp.motion import asked
from scara_config.programs.tp.printer import print_expression
from scara_config.programs.tp.values import ExecutionError, Memory, Value, Written, number, truth

MOST_LINES = 100_000
"""A program that executes more lines does not end, as far as a judge can know [our]."""
GRIPPER, VACUUM = Indexed("RO", (1.0,)), Indexed("RI", (1.0,))
"""The suction and its answer."""
ENDS = (Word("END"), Word("ABORT"))
"""What ends a program before its last line."""
LOCKS = (Word("LOCK PREG"), Word("UNLOCK PREG"))
"""They change when position registers are read, not what is done."""


def walk(flow: Flow, positions: Mapping[int, tuple[float, ...]]) -> Iterator[Step]:
    """Yield what a program does, from its first line to its end.

    Registers are known once the program has set them. The vacuum follows the suction.

    Args:
        flow: The program.
        positions: Joint positions by the number of P[n] [rad or m].

    Raises:
        ConfigError: What it does depends on an input or on a register that it has not set, it
            does not end, or a line asks for what cannot be judged; the text names program and line.
    """
    memory = _Known()
    index, lines = 0, flow.program.lines
    for _ in range(MOST_LINES):
        line: Line | None = Word("END")
        here = index
        if index < len(lines):
            memory.line = here + 1
            index, line = execute(flow, here, memory)
        if line is None:
            continue
        try:
            step = _step(line, here + 1, memory, positions)
        except ExecutionError as error:
            raise ConfigError(flow.named(here, str(error))) from error
        if memory.switched is not None:
            yield memory.switched
            memory.switched = None
        if step is not None:
            yield step
        elif line in ENDS:
            return
    raise ConfigError(f"{flow.program.name}: {MOST_LINES} lines do not lead to its end")


def check_motions(flow: Flow, positions: Collection[int], source: str) -> None:
    """Refuse motions that no robot of this kind could make, whatever its registers hold.

    Args:
        flow: The program.
        positions: Numbers of the P[n] that are taught.
        source: Names the file.

    Raises:
        ConfigError: A position is not taught, a speed out of range, a motion is not executed; the
            text names file, program and line.
    """
    memory = _Known()
    for index, line in enumerate(flow.program.lines):
        if not isinstance(line, MotionLine):
            continue
        try:
            for target in asked(line, memory).targets:
                if target.kind == "P":
                    taught(target, memory, positions)
        except UnknownValueError:
            continue
        except ExecutionError as error:
            raise ConfigError(f"{source}: {flow.named(index, str(error))}") from error


def _step(
    line: Line, shown: int, memory: _Known, positions: Mapping[int, tuple[float, ...]]
) -> Step | None:
    """Return what a line asks for; None: nothing that takes time.

    Raises:
        ExecutionError: It cannot be told beforehand.
    """
    match line:
        case MotionLine():
            return taught_move(line, shown, memory, positions)
        case Wait():
            return WaitStep(shown, number(line.seconds, memory))
        case WaitUntil():
            if not truth(line.condition, memory):
                raise ExecutionError("nothing that the program does makes this true")
            # The answer of the suction is what it waits for: it takes its time in this line.
            if memory.switched is not None:
                memory.switched = GripperStep(shown, memory.switched.on)
            return None
        case Numbered() if line.instruction.kind == "PAYLOAD":
            return None
        case Word() if line in (*ENDS, *LOCKS):
            return None
    raise ExecutionError("what follows cannot be told beforehand")


def taught_move(
    line: MotionLine, shown: int, memory: Memory, positions: Mapping[int, tuple[float, ...]]
) -> MoveStep:
    """Return the step of a joint motion to a position that is taught in joints.

    Args:
        line: The motion.
        shown: Its number.
        memory: Registers and signals.
        positions: Joint positions by the number of P[n] [rad or m].

    Raises:
        ExecutionError: It is another motion, or goes elsewhere: that cannot be judged.
    """
    motion = asked(line, memory)
    (target,) = motion.targets[-1:]
    if target.kind != "P":
        raise ExecutionError(f"{print_expression(target)} is not known beforehand")
    if motion.kind != "J" or motion.percent is None or line.options:
        raise ExecutionError("only J with a speed in % and no option can be judged beforehand")
    place = taught(target, memory, positions)
    fine = motion.cnt is None
    return MoveStep(shown, positions[place], motion.percent, fine, motion.cnt or 0.0)


def taught(target: Indexed, memory: Memory, positions: Collection[int]) -> int:
    """Return the number of a taught position.

    Raises:
        ExecutionError: It is not taught.
    """
    place = int(number(target.index[0], memory))
    if place not in positions:
        raise ExecutionError(f"P[{place}] is not taught, there are {_listed(positions)}")
    return place


def _listed(positions: Collection[int]) -> str:
    return ", ".join(f"P[{number}]" for number in positions) or "none"


class UnknownValueError(ExecutionError):
    """What stands in a register or signal cannot be told without the robot."""


class _Known:
    """Registers and signals that the program itself has set."""

    def __init__(self) -> None:
        self._values: dict[tuple[str, tuple[object, ...]], Value] = {}
        # Number of the line that is executed.
        self.line = 0
        # How the suction was switched, until something that takes time comes behind it.
        self.switched: GripperStep | None = None

    def read(self, place: Indexed | Name) -> Value:
        """Return what the program has put there.

        Raises:
            ExecutionError: It has put nothing there.
        """
        key = _key(GRIPPER if place == VACUUM else place)
        if key not in self._values:
            raise UnknownValueError(f"depends on {print_expression(place)}, which is not known")
        return self._values[key]

    def write(self, place: Indexed | Name, value: Written) -> None:
        """Note what is there from now on."""
        if isinstance(value, Name):
            return  # a timer shows what nobody knows beforehand
        if isinstance(value, PulseTime):
            value = False  # at its end
        self._values[_key(place)] = value
        if place == GRIPPER:
            self.switched = GripperStep(self.line, bool(value))


def _key(place: Indexed | Name) -> tuple[str, tuple[object, ...]]:
    return (place.kind, place.index) if isinstance(place, Indexed) else (place.word, ())
