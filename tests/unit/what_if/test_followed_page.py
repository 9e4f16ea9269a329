"""docs/what_if.md is true: its programs are judged as it says, word by word."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from harness.second_world.followed_page import Typed, commands, programs
from harness.yaml_files import CONFIG
from typer.testing import CliRunner
from what_if.judge_node import app

NUMBER = re.compile(r"-?\d+(?:\.\d+)?")


def parted(line: str) -> tuple[list[str], list[float]]:
    """Return the words of a line, and its numbers: another processor rounds otherwise."""
    words = NUMBER.sub("#", line).split()
    return words, [float(number) for number in NUMBER.findall(line)]


@pytest.mark.parametrize("typed", commands(), ids=lambda typed: " ".join(typed.words))
def test_command_prints_what_the_page_says(
    typed: Typed, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In a folder with the page's programs; a picture that it writes is there."""
    for name, text in programs().items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    done = CliRunner().invoke(app, ["--config-dir", str(CONFIG), *typed.words])
    printed = done.output.rstrip().splitlines()
    assert [parted(line)[0] for line in printed] == [parted(line)[0] for line in typed.printed]
    for line, expected in zip(printed, typed.printed):
        assert parted(line)[1] == pytest.approx(parted(expected)[1], rel=0.02, abs=0.11), line
    for word in typed.words:
        assert not word.endswith(".png") or (tmp_path / word).stat().st_size > 1000


def test_page_shows_a_program_that_is_refused_and_one_that_is_mended() -> None:
    """An empty page would pass."""
    first = [typed.printed[0].split()[0] for typed in commands()]
    assert "REFUSED" in first and any(word.startswith("OK") for word in first)
    assert len(programs()) == 2
