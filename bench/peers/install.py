"""Install the peers into ``bench/.venv``, once: Debian's PyKDL by apt, the others by pip."""

from __future__ import annotations

import hashlib
import os
import subprocess
from pathlib import Path

from rich.console import Console

FOLDER = Path(__file__).resolve().parents[1]
VENV = FOLDER / ".venv"
PINS = FOLDER / "requirements.txt"
PYTHON = VENV / "bin" / "python"
DEBIAN = ("python3-pykdl",)
DEADLINE_S = 600.0


class PeerMissing(RuntimeError):  # noqa: N818 - it is a row's remark, no failure of ours
    """A peer is not installed and cannot be."""


def clean_environment() -> dict[str, str]:
    """Return this process's environment without the workspace's Python path."""
    return {
        name: value
        for name, value in os.environ.items()
        if not name.startswith(("PYTHON", "VIRTUAL_ENV"))
    }


def install(console: Console, log: Path) -> str:
    """Make sure of all peers; return what could not be installed, empty when all is there.

    Args:
        console: Told what takes a while.
        log: Gets the output of apt and pip.
    """
    missing = []
    with log.open("w") as stream:
        if not _has_debian():
            console.print("peers: installing", *DEBIAN)
            missing += (
                []
                if _apt(stream.fileno())
                else [f"{' '.join(DEBIAN)} (by hand: apt-get install {' '.join(DEBIAN)})"]
            )
        stamp = hashlib.sha256(f"{VENV}\n{PINS.read_text()}".encode()).hexdigest()
        if not _stamped(stamp):
            console.print(
                "peers: installing bench/requirements.txt into bench/.venv (about half a "
                "minute, 1.4 GB)"
            )
            if _pip(stream.fileno()):
                (VENV / ".stamp").write_text(stamp)
            else:
                missing.append(f"bench/requirements.txt (see {log})")
    return "; ".join(missing)


def _stamped(stamp: str) -> bool:
    file = VENV / ".stamp"
    return PYTHON.exists() and file.is_file() and file.read_text() == stamp


def _has_debian() -> bool:
    return _run(["dpkg-query", "-W", *DEBIAN], subprocess.DEVNULL)


def _apt(output: int) -> bool:
    """Install Debian's packages; without root's rights nothing is asked for."""
    prefix = [] if os.geteuid() == 0 else ["sudo", "-n"]
    words = [
        *prefix,
        "env",
        "DEBIAN_FRONTEND=noninteractive",
        "apt-get",
        "install",
        "-y",
        "--no-install-recommends",
        *DEBIAN,
    ]
    return _run(words, output) or (
        _run([*prefix, "apt-get", "update"], output) and _run(words, output)
    )


def _pip(output: int) -> bool:
    if not _run(
        ["/usr/bin/python3", "-m", "venv", "--clear", "--system-site-packages", str(VENV)], output
    ):
        return False
    (VENV / "CATKIN_IGNORE").touch()  # rospack and catkin shall not look inside
    words = [
        str(PYTHON),
        "-m",
        "pip",
        "install",
        "--disable-pip-version-check",
        "--no-input",
        "-r",
        str(PINS),
    ]
    return _run(words, output)


def _run(words: list[str], output: int) -> bool:
    try:
        done = subprocess.run(
            words,
            env=clean_environment(),
            stdout=output,
            stderr=output,
            timeout=DEADLINE_S,
            check=False,
        )
    except (OSError, subprocess.TimeoutExpired):
        return False
    return done.returncode == 0
