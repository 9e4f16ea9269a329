"""Write setup/pins.txt, pins_farm.txt and pins_test.txt anew, with the SHA-256 of each wheel.

Usage: /usr/bin/python3 setup/renew_pins.py

pins.txt holds what setup/requirements.txt needs, which is all that a cell needs to run.
pins_farm.txt holds what setup/requirements_farm.txt needs beside that: the farm.
pins_test.txt holds what setup/requirements_test.txt needs beside both: tests, checks, benches and
the documents.

What is pinned keeps its version and its file. To upgrade a package, change its line in
its requirements file, or delete its lines from the pins if another package brings it along.
Debian's packages count as installed, as they do in .venv, and are not pinned: start this where no
Python packages but those of apt.txt are installed.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).resolve().parent
REQUIREMENTS = FOLDER / "requirements.txt"
REQUIREMENTS_FARM = FOLDER / "requirements_farm.txt"
REQUIREMENTS_TEST = FOLDER / "requirements_test.txt"
PINS = FOLDER / "pins.txt"
PINS_FARM = FOLDER / "pins_farm.txt"
PINS_TEST = FOLDER / "pins_test.txt"
PIN = re.compile(r"^([\w.-]+)==(\S+)((?:\s+--hash=sha256:[0-9a-f]{64})+)$")
HEAD = """\
# What ./cell installs into .venv, each with the SHA-256 of its wheel for Debian 12 on amd64.
# Written by setup/renew_pins.py from setup/requirements.txt.
"""
HEAD_FARM = """\
# What ./cell farm installs into .venv beside pins.txt, each with its SHA-256.
# Written by setup/renew_pins.py from setup/requirements_farm.txt.
"""
HEAD_TEST = """\
# What ./cell test, bench, check and docs install into .venv beside both, each with its SHA-256.
# Written by setup/renew_pins.py from setup/requirements_test.txt.
"""

Pins = dict[str, tuple[str, list[str]]]


class PinsError(Exception):
    """The pins cannot be read or must not be written; the text says why and what to do."""


def plain(name: str) -> str:
    """Return a package's name in the spelling that all its spellings share."""
    return re.sub(r"[-_.]+", "-", name).lower()


def statements(text: str) -> list[str]:
    """Return the lines of a requirements file, joined where they go on, without comments."""
    lines = (line.split("#")[0].strip() for line in text.replace("\\\n", " ").splitlines())
    return [line for line in lines if line]


def read_pins(text: str) -> Pins:
    """Read pins as package -> (version, hashes).

    Raises:
        PinsError: A line is no pin, or a package is pinned twice.
    """
    pins: Pins = {}
    for line in statements(text):
        match = PIN.match(line)
        if not match:
            raise PinsError(f"pins.txt: {line!r} is not name==version --hash=sha256:... : mend it.")
        if plain(match[1]) in {plain(name) for name in pins}:
            raise PinsError(f"pins.txt: {match[1]} is pinned twice: delete one of the two.")
        pins[match[1]] = (match[2], re.findall(r"sha256:(\w+)", match[3]))
    return pins


def pins_text(pins: Pins, head: str = HEAD) -> str:
    """Return the text of a file of pins, in the order of the alphabet."""
    entries = (
        " \\\n    ".join([f"{name}=={version}", *(f"--hash=sha256:{digest}" for digest in hashes)])
        for name, (version, hashes) in sorted(pins.items(), key=lambda item: plain(item[0]))
    )
    return head + "".join(f"{entry}\n" for entry in entries)


def pins_of_report(report: dict[str, Any]) -> Pins:
    """Return the pins that pip's installation report asks for."""
    return {
        item["metadata"]["name"]: (
            item["metadata"]["version"],
            [item["download_info"]["archive_info"]["hashes"]["sha256"]],
        )
        for item in report["install"]
    }


def kept_versions(pins: Pins, requirements: str) -> str:
    """Return the pinned versions as constraints, without what requirements.txt decides itself."""
    asked = {plain(line.split("==")[0]) for line in statements(requirements)}
    kept = ((name, version) for name, (version, _) in pins.items() if plain(name) not in asked)
    return "".join(f"{name}=={version}\n" for name, version in kept)


def merge(old: Pins, new: Pins) -> Pins:
    """Return the new pins; a version that was pinned before keeps its hashes.

    Raises:
        PinsError: The same version now comes as another file.
    """
    before = {(plain(name), version): hashes for name, (version, hashes) in old.items()}
    merged: Pins = {}
    for name, (version, hashes) in new.items():
        known = before.get((plain(name), version), hashes)
        if not set(hashes) <= set(known):
            raise PinsError(
                f"{name}=={version} is another file than the pinned one: {hashes[0]} instead of "
                f"{' or '.join(known)}. A version is never published twice: find out why. Only if "
                "you trust the new file, delete the package's lines from pins.txt and start again."
            )
        merged[name] = (version, known)
    return merged


def without(pins: Pins, other: Pins) -> Pins:
    """Return the pins of packages that ``other`` does not hold.

    Raises:
        PinsError: Both hold a package, in different versions.
    """
    there = {plain(name): version for name, (version, _) in other.items()}
    for name, (version, _) in pins.items():
        if there.get(plain(name), version) != version:
            raise PinsError(
                f"the tests need {name}=={version}, the cell {there[plain(name)]}: name a version "
                "in requirements.txt that suits both."
            )
    return {name: pin for name, pin in pins.items() if plain(name) not in there}


def resolve(constraints: str, requirements: list[Path]) -> dict[str, Any]:
    """Let pip find everything that is needed beside Debian's packages; install nothing.

    Raises:
        PinsError: pip found no solution; its own text stands above.
    """
    environment = {key: text for key, text in os.environ.items() if not key.startswith("PYTHON")}
    environment["PYTHONNOUSERSITE"] = "1"
    with tempfile.TemporaryDirectory() as folder:
        venv, kept, report = (Path(folder) / name for name in ("venv", "kept.txt", "report.json"))
        kept.write_text(constraints)
        make = ["/usr/bin/python3", "-m", "venv", "--system-site-packages", str(venv)]
        ask = [str(venv / "bin" / "python"), "-m", "pip", "install", "--quiet", "--no-input"]
        ask += ["--disable-pip-version-check", "--dry-run", "--report", str(report)]
        ask += ["--only-binary", ":all:", "-c", str(kept)]
        ask += [word for file in requirements for word in ("-r", str(file))]
        try:
            for command in (make, ask):
                subprocess.run(command, env=environment, check=True)
        except subprocess.CalledProcessError as error:
            raise PinsError(
                "pip found no solution, see above; pins.txt is as it was. If an old pin is in the "
                "way, delete its lines from pins.txt and start again."
            ) from error
        answer: dict[str, Any] = json.loads(report.read_text())
        return answer


def main() -> int:
    """Renew all files, and say what is different."""
    try:
        old: Pins = {}
        for file in (PINS, PINS_FARM, PINS_TEST):
            old |= read_pins(file.read_text()) if file.exists() else {}
        # All together first: so the cell runs with the versions that the tests have seen.
        all_files = [REQUIREMENTS, REQUIREMENTS_FARM, REQUIREMENTS_TEST]
        asked = "".join(file.read_text() for file in all_files)
        new = merge(old, pins_of_report(resolve(kept_versions(old, asked), all_files)))
        run, with_farm = (
            merge(new, pins_of_report(resolve(kept_versions(new, asked), all_files[:count])))
            for count in (1, 2)
        )
        farm, test = without(with_farm, run), without(new, with_farm)
    except PinsError as error:
        print(f"renew_pins: {error}", file=sys.stderr)
        return 1
    PINS.write_text(pins_text(run))
    PINS_FARM.write_text(pins_text(farm, HEAD_FARM))
    PINS_TEST.write_text(pins_text(test, HEAD_TEST))
    versions_before = {f"{name}=={version}" for name, (version, _) in old.items()}
    versions = {f"{name}=={version}" for name, (version, _) in new.items()}
    for sign, changed in (("-", versions_before - versions), ("+", versions - versions_before)):
        for pin in sorted(changed):
            print(f"{sign} {pin}")
    print(
        f"{len(run)} packages are pinned in setup/pins.txt, {len(farm)} in setup/pins_farm.txt, "
        f"{len(test)} in setup/pins_test.txt. Next: ./cell setup"
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
