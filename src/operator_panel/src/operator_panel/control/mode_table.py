"""What each mode means, and what to press in it: one table for page and document; pure."""

from __future__ import annotations

import msgspec
from scara_config.robot import LEAD_IS_FALSE
from scara_ros.page import page_words

from operator_panel.view.snapshot import CellState
from scara_msgs.msg import TwinControllerState as Mode

RUN = "RUN"
"""In place of a command: the tab from which programs are run."""


class ModeRow(msgspec.Struct, frozen=True):
    """One mode.

    Attributes:
        mode: As in scara_msgs/TwinControllerState.
        meaning: What both robots do, in one sentence.
        press: What to do next, in one sentence.
        button: The command to press, or RUN; empty: nothing but to wait or to mend.
    """

    mode: str
    meaning: str
    press: str
    button: str

    @property
    def title(self) -> str:
        """The mode as the page's bar shows it."""
        return page_words.mode_title(self.mode)


_MOVES = "Pause holds both, STOP ends the motion."
ROWS = (
    ModeRow(
        Mode.OFFLINE,
        "A line is down: nothing follows.",
        "Mend what the alarm names; the line comes back by itself.",
        "",
    ),
    ModeRow(
        Mode.ALIGNING,
        "The twin goes slowly to the real robot.",
        "Wait until both agree; STOP ends it.",
        "",
    ),
    ModeRow(
        Mode.IDLE,
        "Both stand still and agree.",
        "Run a program, jog, or move: whoever moves first leads.",
        RUN,
    ),
    ModeRow(Mode.REAL_LEADS, "The real robot moves, the twin follows.", _MOVES, "PAUSE"),
    ModeRow(Mode.TWIN_LEADS, "The twin moves, the real robot follows.", _MOVES, "PAUSE"),
    ModeRow(Mode.OPERATOR_LEADS, "You move both at once.", _MOVES, "PAUSE"),
    ModeRow(
        Mode.PAUSED,
        "Both are held; the motion is kept.",
        "Resume goes on with it, STOP ends it.",
        "RESUME",
    ),
    ModeRow(
        Mode.STOPPED,
        "Both are stopped; the motion is gone.",
        "Look at both robots, then Align.",
        "ALIGN",
    ),
    ModeRow(
        Mode.STANDSTILL,
        "Both stand with the drives on; whatever moves is a fault.",
        "Reset ends it once nobody is beside the robot, then Align.",
        "RESET",
    ),
    ModeRow(
        Mode.ESTOP,
        "Both were told to stop at once; no motion is accepted until Reset.",
        "Remove the cause, then Reset, then Align.",
        "RESET",
    ),
    ModeRow(
        Mode.FAULT,
        "Something is wrong; both were told to stop.",
        "Remove what the alarm names, then Reset, then Align.",
        "RESET",
    ),
)
_BY_MODE = {row.mode: row for row in ROWS}
# A pair that came apart: what to press instead, where that works.
_APART = {
    Mode.PAUSED: ("Look at both robots, Acknowledge, then Resume.", "ACKNOWLEDGE"),
    Mode.IDLE: ("Look at both robots, then Align.", "ALIGN"),
}


def next_step(state: CellState) -> tuple[str, str]:
    """Return what to do next, in words, and the command whose button is the one to press.

    Args:
        state: The pair. Where it came apart, another button comes first.
    """
    if state.diverged and state.mode in _APART:
        return _APART[state.mode]
    if state.only_followed and state.mode in (Mode.IDLE, Mode.REAL_LEADS):
        # Nothing is written to it: its override cannot be lowered beside a zone either.
        alone = " alone, no zone slows the robot" * state.only_followed.startswith(LEAD_IS_FALSE)
        words = f"The robot is only followed. STOP stops the twin{alone}. {state.only_followed}."
        return words, "STOP"
    row = _BY_MODE.get(state.mode)
    return (row.press, row.button) if row else ("", "")
