"""Frames in the remarks of a program: as long as a controller takes them, and read again."""

from __future__ import annotations

import pytest
from scara_config.frames import FrameTable, TaughtFrame
from scara_config.programs.frame_remarks import LONGEST, frame_remarks, told_frames
from scara_config.programs.tp.listing import Blank, Program, Remark


@pytest.mark.parametrize(
    ("x", "rows"),
    [
        (111.1104, ["UFRAME[1] X 111.11 Y 222.2 Z 3.3"]),
        (111.1114, ["UFRAME[1] X 111.111 Y 222.2", "UFRAME[1] Z 3.3"]),
    ],
)
def test_a_remark_is_as_long_as_a_controller_takes_it(x: float, rows: list[str]) -> None:
    """Up to its last character: what does not fit goes into a second one. Told are thousandths."""
    table = FrameTable({"uframe_1": TaughtFrame("box", (x, 222.2, 3.3))}, {})
    remarks = tuple(frame_remarks(table, [("user", 1)]))
    assert [remark.text for remark in remarks] == rows
    assert max(map(len, rows)) <= LONGEST
    assert told_frames(Program("MINE", (Remark("!", "mine"), Blank(), *remarks))) == {
        ("user", 1): (round(x, 3), 222.2, 3.3, 0, 0, 0)
    }
