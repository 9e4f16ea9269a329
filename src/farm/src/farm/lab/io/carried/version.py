"""Which version of the project a machine of the lab has: results of another one may be different.

Counted is what is in the files, not what a version control says of them: a change that was not
committed counts too, and a machine without git has a version.
"""

from __future__ import annotations

import hashlib
import os
import platform
from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree

import msgspec
from scara_config.loader import OVERRIDE

from farm.lab.io.running import LabError

MANIFEST = Path("src", "farm", "package.xml")
COUNTED = ("src", "setup")
"""Folders of the project, beside that of the settings."""
LEFT_OUT = ("__pycache__", ".pyc", ".egg-info")
SHOWN = 12
"""Digits of the content that are printed."""


class Version(msgspec.Struct, frozen=True):
    """What results depend on beside a job's words and files.

    Attributes:
        package: Version of the package.
        content: sha256 of all sources, settings and pins.
        python: Version and processor's kind.
    """

    package: str
    content: str
    python: str

    def __str__(self) -> str:
        """Return it as a person reads it."""
        return f"{self.package} ({self.content[:SHOWN]}, Python {self.python})"


def version_of(root: Path) -> Version:
    """Return the version that a machine has.

    Args:
        root: Folder of the project.

    Raises:
        LabError: Its files cannot be read.
    """
    whole = hashlib.sha256()
    settings = Path(os.environ.get(OVERRIDE) or root / "config")
    folders = [*((name, root / name) for name in COUNTED), ("config", settings)]
    try:
        for name, folder in folders:
            for file in _files(folder):
                digest = hashlib.sha256(file.read_bytes()).hexdigest()
                whole.update(f"{digest} {name}/{file.relative_to(folder).as_posix()}\n".encode())
    except OSError as error:
        raise LabError(f"{error.filename}: {error.strerror}") from error
    python = f"{platform.python_version()} {platform.machine()}"
    return Version(_package(root / MANIFEST), whole.hexdigest(), python)


def refusal(here: Version, there: Version, who: str) -> str:
    """Return why two machines may not work together; empty: they may.

    Args:
        here: Of this machine.
        there: Of the other.
        who: What the other is.
    """
    if here == there:
        return ""
    return (
        f"this machine has version {here}, {who} has {there}: results could differ. Give both the "
        "same commit and the same changes, ./cell setup and ./cell build, then start it anew"
    )


def _files(folder: Path) -> Iterator[Path]:
    """Yield what counts of a folder, in order of names."""
    for file in sorted(folder.rglob("*")):
        parts = file.relative_to(folder).parts
        if file.is_file() and not any(part.endswith(LEFT_OUT) for part in parts):
            yield file


def _package(manifest: Path) -> str:
    if not manifest.exists():
        return "unknown"
    found = ElementTree.fromstring(manifest.read_bytes()).findtext("version")
    return str(found or "unknown").strip()
