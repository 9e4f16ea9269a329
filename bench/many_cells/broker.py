"""mosquitto for a comparison: Debian's, as it is installed, or unpacked into ``build`` for this.

Debian's package would start a broker with the machine; unpacked it does not, and needs no root.
"""

from __future__ import annotations

import getpass
import os
import shutil
import socket
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
UNPACKED = ROOT / "build" / "peers" / "mosquitto"
PACKAGES = (
    "mosquitto",
    "libmosquitto1",
    "libcjson1",
    "libdlt2",
    "libwebsockets17",
    "libev4",
    "libuv1",
    "libwrap0",
)
PLACES = "/usr/local/sbin:/usr/sbin:/usr/bin"
DEADLINE_S = 120.0
START_S = 10.0


class BrokerError(RuntimeError):
    """mosquitto is not there and cannot be had; the text says why."""


@contextmanager
def broker(folder: Path, port: int) -> Iterator[int]:
    """Keep a broker on loopback for the length of a block; gives its process id.

    Args:
        folder: For its settings.
        port: Where it listens.

    Raises:
        BrokerError: See there.
    """
    program, environment = _program()
    settings = folder / "mosquitto.conf"
    settings.write_text(
        f"listener {port} 127.0.0.1\nallow_anonymous true\nset_tcp_nodelay true\n"
        "persistence false\nlog_type error\n"
        f"user {getpass.getuser()}\n",
        encoding="ascii",
    )
    process = subprocess.Popen([program, "-c", str(settings)], env=environment)
    try:
        _wait(process, port)
        yield process.pid
    finally:
        process.terminate()
        process.wait(START_S)


def _wait(process: subprocess.Popen[bytes], port: int) -> None:
    until = time.monotonic() + START_S
    while True:
        with socket.socket() as knock:
            if knock.connect_ex(("127.0.0.1", port)) == 0:
                return
        if process.poll() is not None or time.monotonic() > until:
            raise BrokerError(f"mosquitto does not listen; exit code {process.poll()}")
        time.sleep(0.02)


def _program() -> tuple[str, dict[str, str]]:
    """Return the program and its environment."""
    if found := shutil.which("mosquitto", path=PLACES):
        return found, dict(os.environ)
    program = UNPACKED / "usr" / "sbin" / "mosquitto"
    if not program.is_file():
        _unpack()
    libraries = UNPACKED / "usr" / "lib" / "x86_64-linux-gnu"
    return str(program), {**os.environ, "LD_LIBRARY_PATH": str(libraries)}


def _unpack() -> None:
    """Let apt fetch the packages, and unpack them."""
    UNPACKED.mkdir(parents=True, exist_ok=True)
    try:
        for package in PACKAGES:
            _run("apt-get", "download", package)
        for file in UNPACKED.glob("*.deb"):
            _run("dpkg", "-x", str(file), str(UNPACKED))
    except (OSError, subprocess.SubprocessError) as error:
        raise BrokerError(f"{error}: install Debian's package mosquitto") from error


def _run(*words: str) -> None:
    subprocess.run(words, cwd=UNPACKED, check=True, capture_output=True, timeout=DEADLINE_S)
