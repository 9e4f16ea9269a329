"""A program whose library only some need says so in one line, with the command that installs it."""

from __future__ import annotations

import pytest
from scara_ros.nodes.needed_library import require_library


def test_a_library_that_is_there_is_nothing_to_say(capsys: pytest.CaptureFixture[str]) -> None:
    """And the program goes on."""
    require_library("json", "run")
    assert capsys.readouterr().err == ""


def test_a_missing_library_ends_the_program_with_what_to_do(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """One line, the program's name in front, and the exit code that the program promises."""
    monkeypatch.setattr("sys.argv", ["/ws/devel/lib/what_if/judge", "ARTICLE"])
    with pytest.raises(SystemExit) as ended:
        require_library("no_such_library", "run", code=3)
    assert ended.value.code == 3
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("judge: the library no_such_library is not installed")
    assert line.endswith("To install it: ./cell setup run")
