"""STOP PAUSE RESUME ESTOP RESET YIELD, each obeyed once; who has command of a joint; states."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from enum import Enum, IntEnum

from scara_config.text_enum import StrEnum

from scara_control.errors import ScaraControlError
from scara_msgs.msg import MotionState

STOPPED_AGAIN = "the pair is stopped: ALIGN, then it may lead"
"""Why the twin controller stops a motion that begins in STOPPED: who asked for it is named."""


class MotionRefusedError(ScaraControlError):
    """A motion is not allowed now or not at all; the text says why."""


class Command(IntEnum):
    """The commands of scara_msgs/MotionCommand."""

    STOP = 1
    PAUSE = 2
    RESUME = 3
    ESTOP = 4
    RESET = 5
    YIELD = 6

    def text(self, reason: str) -> str:
        """Return the command with its reason, for people."""
        return f"{self.name}: {reason}" if reason else self.name


class CommandInbox:
    """Lets each command through once.

    A sender may repeat a command; one with the same sender and id within ``memory`` is not obeyed
    again. Afterwards it is, so that a sender that starts anew and counts from 1 is heard. Id 0
    (typed by hand) is always obeyed.
    """

    def __init__(self, memory: float) -> None:
        """Start without any command; ``memory`` [s]."""
        self._memory = memory
        self._seen: dict[tuple[str, int], float] = {}
        self.last_id = 0

    def accept(self, sender: str, number: int, now: float) -> bool:
        """Say whether the command is to be obeyed, and remember it."""
        self._seen = {key: at for key, at in self._seen.items() if now - at < self._memory}
        fresh = number == 0 or (sender, number) not in self._seen
        self._seen[sender, number] = now
        self.last_id = number
        return fresh


class Ownership:
    """Which of our joints the simulator obeys us with, by ``twin/controller_modes``."""

    def __init__(self, mode: str) -> None:
        """Ours are the joints in ``mode``."""
        self._mode = mode
        self._modes: dict[str, str] = {}
        self._names: frozenset[str] = frozenset()
        self._ours: set[str] = set()

    def begin(self, names: Iterable[str]) -> None:
        """Note that a motion of ``names`` begins.

        A joint is ours once the simulator has said so.
        """
        self._names = frozenset(names)
        self._ours = {name for name in self._names if self._modes.get(name) == self._mode}

    def update(self, modes: Mapping[str, str]) -> dict[str, str]:
        """Take the modes in; return the joints that were taken from us.

        Each comes with its new mode.
        """
        self._modes = dict(modes)
        lost = {
            name: modes[name] for name in self._ours if name in modes and modes[name] != self._mode
        }
        self._ours = {name for name in self._names if modes.get(name) == self._mode}
        return lost

    def foreign(self, name: str) -> str:
        """Return the mode of a joint that is not in ours, or an empty text."""
        mode = self._modes.get(name, self._mode)
        return "" if mode == self._mode else mode


def taken_text(lost: Mapping[str, str]) -> str:
    """Say who took which joints."""
    return ", ".join(
        f"{name} was taken by its {mode} controller" for name, mode in sorted(lost.items())
    )


def parse_modes(text: str) -> dict[str, str]:
    """Read ``joint_1:trajectory joint_2:position``; words without a colon are left out.

    Example:
        >>> parse_modes("joint_1:trajectory joint_2:position")
        {'joint_1': 'trajectory', 'joint_2': 'position'}
    """
    pairs = (word.partition(":") for word in text.split())
    return {name: mode for name, colon, mode in pairs if colon}


class State(StrEnum):
    """What joint_pose_controller does."""

    IDLE = MotionState.IDLE
    ANNOUNCING = MotionState.ANNOUNCING
    MOVING = MotionState.MOVING
    FOLLOWING = MotionState.FOLLOWING
    PAUSING = MotionState.PAUSING
    PAUSED = MotionState.PAUSED
    STOPPING = MotionState.STOPPING
    ESTOPPED = MotionState.ESTOPPED


class Phase(Enum):
    """What is done about the path under way."""

    GOING = "it is followed; so is none"
    PARKED = "it is paused, and its set points at rest are sent"
    STOPPING = "a ramp has taken its place, also when paused; or another motion was told to stop"
