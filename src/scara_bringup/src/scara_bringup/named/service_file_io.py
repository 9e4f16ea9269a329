"""Write a cell's service unit, and let systemd check it; nothing is enabled or started."""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
from pathlib import Path

from scara_bringup.named.service_unit import Service, unit_text

CHECK_S = 20.0
"""Our choice: systemd checks a unit in well under a second."""
MACHINE = Path("/etc/systemd/system")
"""Where units of the whole machine are."""


class InstallError(RuntimeError):
    """The unit cannot be written, or systemd refuses it; the text says why and what to do."""


def personal_units() -> Path:
    """Return the folder of a person's own units."""
    home = os.environ.get("XDG_CONFIG_HOME") or str(Path.home() / ".config")
    return Path(home) / "systemd" / "user"


def write_unit(service: Service, folder: Path) -> Path:
    """Write a unit; the old one stays if systemd refuses the new one.

    Raises:
        InstallError: The folder cannot be written to, or systemd refuses the unit.
    """
    path = folder / service.file
    try:
        folder.mkdir(parents=True, exist_ok=True)
        # Beside its place: a file can be renamed on the same disk only.
        with tempfile.TemporaryDirectory(prefix=".cell-", dir=folder) as beside:
            new = Path(beside) / service.file
            new.write_text(unit_text(service), encoding="utf-8")
            if fault := refusal(new):
                raise InstallError(f"{path}: nothing was changed; systemd refuses it: {fault}")
            new.replace(path)
    except OSError as error:
        raise InstallError(
            f"{path}: {error.strerror}; --folder names another place, --machine needs root"
        ) from error
    return path


def remove_unit(service: Service, folder: Path) -> Path:
    """Remove a unit.

    Raises:
        InstallError: It is not there, or cannot be removed.
    """
    path = folder / service.file
    try:
        path.unlink()
    except OSError as error:
        raise InstallError(f"{path}: {error.strerror}") from error
    return path


def refusal(unit: Path) -> str:
    """Return what systemd has against a unit; empty: nothing, or there is no systemd here."""
    program = shutil.which("systemd-analyze")
    if program is None:
        return ""
    try:
        done = subprocess.run(
            # As one of the machine: to check one of a person it would want a session.
            [program, "verify", "--system", "--man=no", "--recursive-errors=no", str(unit)],
            capture_output=True,
            text=True,
            timeout=CHECK_S,
        )
    except subprocess.TimeoutExpired:
        return f"no answer within {CHECK_S:g} s"
    said = [line for line in done.stderr.splitlines() if unit.name in line]
    return "; ".join(said) if done.returncode else ""
