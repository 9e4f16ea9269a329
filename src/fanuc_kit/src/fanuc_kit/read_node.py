"""Read a controller's own printouts: rosrun fanuc_kit read FOLDER|FILE ... [--robot NAME].

They say what is not set yet and propose values of robot.yaml. Nothing is asked over the wire.
Exit code 0: nothing is missing, 1: something is, 2: a file cannot be read.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from scara_config import ConfigError, load_robot
from scara_config.loader import load_text
from scara_config.modbus_map import load_modbus_map
from scara_config.programs.files import program_files
from scara_config.set_up.kit_map import kit_map
from scara_ros.shell.command_line_io import CommandLine, ConfigDir, RobotName, choose_robot
from scara_ros.shell.program_io import WRONG

from fanuc_kit.judge import missing, proposals, unheard
from fanuc_kit.printouts import Printout, read_printout

_SETS_TOOL = re.compile(r"^\s*\d*:\s*UTOOL\[1(:[^\]]*)?\]\s*=", re.MULTILINE)
ENDS = (".va", ".dg", ".ls", ".txt", ".htm", ".stm")
app = CommandLine(
    "read", dict.fromkeys((ConfigError, OSError), WRONG), help="Read a controller's own printouts."
)


@app.command()
def read(
    files: Annotated[list[Path], typer.Argument(help="Printouts, or folders of them.")],
    robot: RobotName = None,
    config_dir: ConfigDir = None,
) -> None:
    """Read a controller's own printouts."""
    choose_robot(robot)
    profile, found = load_robot(config_dir), Printout()
    layout = kit_map(load_modbus_map(config_dir), profile.lead)
    for path in _files(files):
        try:
            text = path.read_text(encoding="utf-8", errors="replace")
        except OSError as error:
            raise ConfigError(f"{path}: cannot be read: {error}") from error
        read_printout(text, path.name, found)
    console = Console(highlight=False, soft_wrap=True)
    texts = map(load_text, program_files(config_dir).values())
    # Not only the program that moves: a frame that any program sets stays set on the controller.
    tool_is_set = any(_SETS_TOOL.search(text) for text in texts)
    gaps = list(missing(layout, found, profile.lead, tool_is_set))
    offers = list(proposals(profile, found))
    for title, lines in (
        ("not set", gaps),
        ("robot.yaml", offers),
        ("not in these printouts, so not judged", unheard(found)),
        ("not understood", found.unread),
    ):
        console.print(f"{title}: {len(lines)}", style="bold", markup=False)
        for line in lines:
            console.print(f"  {line}", markup=False)
    raise typer.Exit(1 if gaps else 0)


def _files(paths: list[Path]) -> list[Path]:
    """Return the printouts among paths, those of folders by their ends."""
    found: list[Path] = []
    for path in paths:
        inside = sorted(path.iterdir()) if path.is_dir() else [path]
        found += [each for each in inside if not path.is_dir() or each.suffix.lower() in ENDS]
    if not found:
        raise ConfigError(f"{', '.join(map(str, paths))}: no printout ({', '.join(ENDS)})")
    return found


main = app.run
