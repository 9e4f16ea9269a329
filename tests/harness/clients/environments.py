"""Where `./cell test --clients` has installed other people's programs, and how to run theirs."""

from __future__ import annotations

import json
import os
import shutil
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

from harness.workspace import ROOT

INSTALLED = ROOT / ".venv" / "clients"
WANTED = ROOT / "setup" / "clients"
SHARED = ROOT / "tests" / "clients"
"""What the scripts share: checks.py, checks.js."""

ALL = "CELL_CLIENTS_PAGE" in os.environ
"""Whether all of them are to be run: `./cell test --clients` says so."""


def workspace(name: str) -> str:
    """Return the setup.bash of a catkin workspace of setup/clients; empty where it is not built."""
    setup = INSTALLED / name / "devel" / "setup.bash"
    return str(setup) if ALL and setup.is_file() else ""


UPSTREAM = workspace("rosbridge_server")
NOT_BUILT = "./cell test --clients builds it, where its repositories can be cloned"


class Environment(NamedTuple):
    """What runs a client's scripts, and where it finds the client."""

    name: str
    program: str
    modules: str = ""

    @property
    def variables(self) -> dict[str, str]:
        """The variables: no path leads it to our modules, only to what the scripts share."""
        return {"PYTHONPATH": str(SHARED), "NODE_PATH": self.modules}

    def put(self, folder: Path, *scripts: Path) -> Path:
        """Put scripts where Node.js looks for the client's modules too; return the first one.

        A module's ``import`` is looked up beside the script alone, whatever NODE_PATH says.
        """
        folder = folder / self.name
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "node_modules").symlink_to(self.modules)
        for script in scripts:
            shutil.copy(script, folder)
        return folder / scripts[0].name


OWN = Environment("own", sys.executable)
"""The project's own."""


def installed(pattern: str) -> list[Environment]:
    """Return the environments whose file in setup/clients fits ``pattern``; none in `./cell test`.

    One that is missing is there too: its test fails, and so no column of the table does.
    """
    if not ALL:
        return []
    files = sorted(file for file in WANTED.glob(pattern) if file.suffix in (".json", ".txt"))
    return [_environment(file) for file in files]


def _environment(file: Path) -> Environment:
    folder = INSTALLED / file.stem
    if file.suffix == ".txt":
        return Environment(file.stem, str(folder / "bin" / "python"))
    return Environment(file.stem, shutil.which("node") or "node", str(folder / "node_modules"))


def results(lines: Iterable[str]) -> tuple[tuple[str, str], dict[str, str | None]]:
    """Return client and version, and what went wrong by check, of what a script has printed."""
    found = [json.loads(line) for line in lines if line.startswith('{"')]
    client, *checks = found
    return (client["client"], client["version"]), {one["check"]: one["wrong"] for one in checks}
