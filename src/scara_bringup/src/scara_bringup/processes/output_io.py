"""The folder of one run: logs, bag and report."""

from __future__ import annotations

from datetime import datetime
from pathlib import Path

from scara_ros.names import folder_of
from scara_ros.shell.program_io import new_run_folder, runs_folder

from scara_bringup.processes.preflight_io import namespace


def runs_of(folder: Path, wanted: Path | None) -> Path:
    """Return the folder that holds all recordings of a cell.

    Args:
        folder: Of this run, resolved.
        wanted: What the caller has asked for.

    Returns:
        ``wanted``, else runs/ if ``folder`` lies in it, else ``folder`` itself: a person's own
        folder around it is none of the recorder's business.
    """
    if wanted is not None:
        return wanted.resolve()
    usual = runs_folder().resolve()
    return usual if folder.is_relative_to(usual) else folder


def make_output(wanted: Path | None) -> Path:
    """Create the folder of this run and return it.

    Without a wish it is ``runs/<time>``, in a namespace ``runs/<time>_<namespace>``; with ``_2``
    behind it where another run has begun in the same second.

    Raises:
        OSError: It cannot be made, or is no folder.
    """
    if wanted is not None:
        wanted.mkdir(parents=True, exist_ok=True)
        return wanted.resolve()
    name = folder_of(datetime.now().strftime("%Y-%m-%d_%H-%M-%S"), namespace())
    return new_run_folder(runs_folder(), name).resolve()
