"""Command ``retell``: reads a recording for the page's time line; the page starts it by itself.

    rosrun operator_panel retell BAG | wc --bytes

Writes the lines of :mod:`operator_panel.retelling.lines` to standard output, in the order of time.
Needs no cell and no ROS master. Exit code: 0 all told, 2 wrong configuration, 3 the bag cannot be
used.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer
from cell_recorder.reading.bag_reader_io import BagError
from scara_config import ConfigError, config_directory
from scara_ros.shell.command_line_io import CommandLine, ConfigDir
from scara_ros.shell.program_io import UNUSABLE, WRONG

from operator_panel.config import load_panel
from operator_panel.retelling.bag_teller_io import lines_of
from operator_panel.retelling.lines import packed

app = CommandLine(
    "retell",
    {ConfigError: WRONG, BagError: UNUSABLE, OSError: UNUSABLE},
    help="Tell a recording again, for the page's time line.",
)


@app.command()
def retell(
    bag: Annotated[Path, typer.Argument(help="Recording of a run, unfinished ones too.")],
    config_dir: ConfigDir = None,
) -> None:
    """Write what a page shows of a recording to standard output."""
    if sys.stdout.isatty():
        raise ConfigError("retell writes bytes for the page's server: give it a pipe or a file")
    try:
        config = load_panel(config_dir or config_directory())
        for line in lines_of(bag, config.silent_ms * 1e-3):
            sys.stdout.buffer.write(packed(line))
        sys.stdout.buffer.flush()
    except BrokenPipeError:
        sys.stderr.close()  # nobody looks any longer


main = app.run
