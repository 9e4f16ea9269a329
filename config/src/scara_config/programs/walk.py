"""Look at a program's lines without a robot: which motions none of its kind could make."""

from __future__ import annotations

from collections.abc import Collection

from scara_config.loader import ConfigError
from scara_config.programs.tp.execution import Flow
from scara_config.programs.tp.listing import Indexed, MotionLine, Name
from scara_config.programs.tp.motion import asked
from scara_config.programs.tp.printer import print_expression
from scara_config.programs.tp.values import ExecutionError, Memory, Value, Written, number


class UnknownValueError(ExecutionError):
    """What stands in a register or signal cannot be told without the robot."""


class _Nothing:
    """Registers and signals of which nothing is known."""

    def read(self, place: Indexed | Name) -> Value:
        """Refuse to tell."""
        raise UnknownValueError(f"depends on {print_expression(place)}, which is not known")

    def write(self, place: Indexed | Name, value: Written) -> None:
        """Forget it."""


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
    memory = _Nothing()
    for index, line in enumerate(flow.program.lines):
        if not isinstance(line, MotionLine):
            continue
        try:
            for target in asked(line, memory).targets:
                if target.kind == "P":
                    taught(target, memory, positions)
        # Not known is not wrong: the robot tells when it gets there.
        except UnknownValueError:
            continue
        except ExecutionError as error:
            raise ConfigError(f"{source}: {flow.named(index, str(error))}") from error


def taught(target: Indexed, memory: Memory, positions: Collection[int]) -> int:
    """Return the number of a taught position.

    Raises:
        ExecutionError: It is not taught.
    """
    place = int(number(target.index[0], memory))
    if place not in positions:
        there = ", ".join(f"P[{each}]" for each in positions) or "none"
        raise ExecutionError(f"P[{place}] is not taught, there are {there}")
    return place
