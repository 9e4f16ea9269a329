"""Print what a delivered controller needs: rosrun fanuc_kit make ROBOT [--out FOLDER].

A folder of sheets in Markdown, and the same as ``kit.html`` for the printer: settings with their
menus, the slots of $SNPX_ASG, signals, programs to type, steps to try. Beside them the map of a
robot that is set up so, for config/robots/ROBOT.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from scara_config import ConfigError, load_robot
from scara_config.files.whole_file import write_whole
from scara_config.modbus_map import load_modbus_map
from scara_config.profile import chosen_robot
from scara_config.set_up.kit_map import kit_map
from scara_config.set_up.kit_programs import texts as program_texts
from scara_config.set_up.slots import slot_problems
from scara_ros.shell.command_line_io import CommandLine, ConfigDir, choose_robot
from scara_ros.shell.program_io import WRONG

from fanuc_kit.sheet import html, markdown
from fanuc_kit.sheets import map_file, sheets_of

app = CommandLine("make", {ConfigError: WRONG}, help="Print what a delivered controller needs.")


@app.command()
def make(
    robot: Annotated[str | None, typer.Argument(help="Folder of config/robots.")] = None,
    out: Annotated[Path | None, typer.Option(help="Folder; default: kit_ROBOT, here.")] = None,
    config_dir: ConfigDir = None,
) -> None:
    """Print what a delivered controller needs."""
    choose_robot(robot)
    profile, own = load_robot(config_dir), load_modbus_map(config_dir)
    layout = kit_map(own, profile.lead)
    for problem in slot_problems(layout):
        raise ConfigError(f"modbus_map.yaml: {problem}")
    folder = out or Path(f"kit_{chosen_robot()}")
    sheets = sheets_of(profile, layout)
    texts = {f"{sheet.name}.md": markdown(sheet) for sheet in sheets}
    texts["modbus_map.yaml"] = map_file(layout)
    texts["kit.html"] = html(f"{profile.name}: kit", sheets)
    if profile.lead:
        texts |= {f"{name}.LS": text for name, text in program_texts().items()}
    files = {folder / name: text.encode() for name, text in texts.items()}
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for path, content in files.items():
            # Whoever fits the robot mends its map: the coils that stop it may have other numbers.
            if path.exists() and path.read_bytes() != content:
                what = f"{path}: is there with other content"
                raise ConfigError(f"{what}; name another folder by --out")
        for path, content in files.items():
            write_whole(path, content)
    except OSError as error:
        raise ConfigError(f"{folder}: cannot be written: {error}") from error
    console = Console(highlight=False, soft_wrap=True)
    for path in files:
        console.print(f"made {path}", markup=False)
    console.print(f"next: print {folder / 'kit.html'}, begin with its first sheet", markup=False)


main = app.run
