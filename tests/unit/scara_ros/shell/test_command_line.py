"""The shell of every command."""

from __future__ import annotations

import os
from typing import Annotated

import pytest
import typer
from scara_config.profile import CHOICE
from scara_ros.shell.command_line_io import CommandLine, RobotName, choose_robot
from typer.testing import CliRunner

app = CommandLine("measure", {ValueError: 2}, help="Measure a robot.", rich_markup_mode=None)


@app.callback()
def begin(robot: RobotName = None) -> None:
    """Choose the robot."""
    choose_robot(robot)
    if robot == "none":
        raise ValueError("no such robot")


@app.command()
def times(count: Annotated[int, typer.Argument(help="How often.")]) -> None:
    """Say the count and the robot."""
    if count < 0:
        raise ValueError(f"count = {count}: allowed is 0 and more")
    typer.echo(f"{count} {os.environ[CHOICE]}")


@pytest.fixture(autouse=True)
def robot_as_before(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let no test leave its robot to the next one."""
    monkeypatch.setenv(CHOICE, "before")


def test_the_options_and_helps_are_those_of_the_functions() -> None:
    """What is wrapped around them is not seen."""
    told = CliRunner().invoke(app, ["times", "--help"]).output
    assert "Say the count and the robot." in told and "How often." in told and "count <int>" in told


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["times", "--", "-1"], "measure: count = -1: allowed is 0 and more\n"),
        (["--robot", "none", "times", "1"], "measure: no such robot\n"),
    ],
)
def test_an_error_of_each_function_is_one_line_and_its_code(words: list[str], said: str) -> None:
    """Of a word, and of what runs before each word."""
    done = CliRunner().invoke(app, words)
    assert (done.exit_code, done.output) == (2, said)


def test_remappings_of_rosrun_are_no_words(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """And the robot that was chosen holds for the process."""
    words = ["measure", "__name:=x", "--robot", "six", "times", "3", "_rate:=2"]
    monkeypatch.setattr("sys.argv", words)
    with pytest.raises(SystemExit) as ended:
        app.run()
    assert ended.value.code == 0 and capsys.readouterr().out == "3 six\n"
