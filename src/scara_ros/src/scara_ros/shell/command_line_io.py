"""The shell of every command: its words, one line for each error, its exit codes."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, TypeVar

import typer
from scara_config.profile import CHOICE

from scara_ros.shell.program_io import Codes, ends_with, without_remappings

Function = TypeVar("Function", bound=Callable[..., Any])

ConfigDir = Annotated[
    Path | None, typer.Option(help="Folder with the YAML files; default: the package scara_config.")
]
RobotName = Annotated[
    str | None,
    typer.Option(help="Folder of config/robots; default: SCARA_ROBOT, else fanuc_sr6ia."),
]
"""To be handed to ``choose_robot``."""


def choose_robot(name: str | None) -> None:
    """Let this process and those that it starts read the files of a robot; None: as it is."""
    if name is not None:
        os.environ[CHOICE] = name


class CommandLine(typer.Typer):
    """One command, or one with words of its own.

    Example::

        command_line = CommandLine("report", {ConfigError: WRONG}, help="Rebuild the report.")

        @command_line.command()
        def report(bag: Path) -> None: ...

        main = command_line.run
    """

    def __init__(self, name: str, codes: Codes, **options: Any) -> None:
        """Take words by ``command`` and ``callback``, as every Typer does.

        Args:
            name: What it is called; its errors begin with it.
            codes: What ends it with one line, and with which exit code.
            options: Of Typer.
        """
        super().__init__(add_completion=False, **options)
        self._name, self._ends = name, ends_with(name, codes)

    def command(self, *words: Any, **options: Any) -> Callable[[Function], Function]:
        """Add a function as a word."""
        return self._adding(super().command(*words, **options))

    def callback(self, *words: Any, **options: Any) -> Callable[[Function], Function]:
        """Add the function that runs before each word."""
        return self._adding(super().callback(*words, **options))

    def run(self) -> None:
        """Run with the words of this process; the remappings that rosrun passes mean nothing.

        Raises:
            SystemExit: Always.
        """
        self(without_remappings(sys.argv[1:]), prog_name=self._name)

    def _adding(self, add: Callable[..., Any]) -> Callable[[Function], Function]:
        def added(function: Function) -> Function:
            add(self._ends(function))
            return function

        return added
