"""What a robot says of its program."""

from __future__ import annotations

import pytest
from scara_ros.robot_program import current_line


@pytest.mark.parametrize(
    ("said", "found"),
    [
        ("ARTICLE line 5 running", ("ARTICLE", 5)),
        ("ARTICLE line 12 paused", ("ARTICLE", 12)),
        ("ARTICLE line 5 aborted", ("", 0)),
        ("", ("", 0)),
        ("no program", ("", 0)),
    ],
)
def test_current_line_is_that_of_a_program_that_is_not_over(
    said: str, found: tuple[str, int]
) -> None:
    """A program that was ended is in no line."""
    assert current_line(said) == found
