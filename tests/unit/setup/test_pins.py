"""setup/pins.txt and what reads and writes it: every package has its hash, a wrong one is told."""

from __future__ import annotations

import hashlib
import importlib.metadata
import importlib.util
import os
import shutil
import subprocess
import sys
import zipfile
from collections.abc import Iterator
from pathlib import Path

import pytest
from harness.workspace import ROOT
from packaging.requirements import Requirement

SPEC = importlib.util.spec_from_file_location("renew_pins", ROOT / "setup" / "renew_pins.py")
assert SPEC is not None and SPEC.loader is not None
renew_pins = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(renew_pins)

KINDS = {"": renew_pins.HEAD, "_farm": renew_pins.HEAD_FARM, "_test": renew_pins.HEAD_TEST}
"""What each file of pins begins with: of a cell, the farm, the tests."""
TEXTS = {kind: (ROOT / "setup" / f"pins{kind}.txt").read_text() for kind in KINDS}
PINS = {kind: renew_pins.read_pins(text) for kind, text in TEXTS.items()}
REQUIREMENTS = {
    kind: renew_pins.statements((ROOT / "setup" / f"requirements{kind}.txt").read_text())
    for kind in KINDS
}
A, B = "a" * 64, "b" * 64
MISMATCH = """\
ERROR: THESE PACKAGES DO NOT MATCH THE HASHES FROM THE REQUIREMENTS FILE. If you have updated ...
    msgspec==0.22.0 from file:///somewhere/msgspec.whl (from -r setup/pins.txt (line 1)):
        Expected sha256 a
             Got        b
"""


def installed_by(script: str, root: Path) -> subprocess.CompletedProcess[str]:
    """Run a script in a copy of the set-up, with its functions sourced; pip sees no index."""
    shutil.copytree(ROOT / "setup", root / "setup", dirs_exist_ok=True)
    whole = "root=$PWD; logs=$PWD; for f in steps install; do source setup/$f.sh; done\n" + script
    foreign = {"PIP_NO_INDEX": "1", "PIP_FIND_LINKS": str(root), "PIP_CONFIG_FILE": "/dev/null"}
    return subprocess.run(
        ["bash", "-c", whole],
        cwd=root,
        env={**os.environ, **foreign},
        capture_output=True,
        text=True,
        timeout=120,
    )


def test_every_requirement_is_pinned_with_its_version() -> None:
    """Only pins.txt is installed: what it does not hold would be missing."""
    for kind, pins in PINS.items():
        pinned = {f"{renew_pins.plain(name)}=={version}" for name, (version, _) in pins.items()}
        asked = (line.split("==") for line in REQUIREMENTS[kind])
        assert [f"{n}=={v}" for n, v in asked if f"{renew_pins.plain(n)}=={v}" not in pinned] == []


def test_what_tests_need_is_not_installed_for_a_cell() -> None:
    """No package is pinned twice, and the browser's driver is not among those of a cell."""
    run, farm, test = ({renew_pins.plain(name) for name in pins} for pins in PINS.values())
    assert run & farm == run & test == farm & test == set()
    assert {"pytest", "playwright", "mypy", "mkdocs"} <= test
    assert {"eclipse-zenoh", "duckdb", "pyarrow", "distributed"} <= farm
    assert "coal" in run  # Preview is there without another set-up
    with pytest.raises(renew_pins.PinsError, match="need x==2, the cell 1"):
        renew_pins.without({"x": ("2", [A])}, {"X": ("1", [A])})


def test_every_pin_has_a_hash_and_none_twice() -> None:
    """The file is read strictly; it holds more than the project itself asks for."""
    assert len(PINS[""]) > len(REQUIREMENTS[""])
    assert [name for name, (_, hashes) in PINS[""].items() if not hashes] == []


def version_there(name: str, pinned: set[str]) -> str:
    """Return the version that a pin or Debian brings; what else is in .venv does not count."""
    try:
        found = importlib.metadata.distribution(name)
    except importlib.metadata.PackageNotFoundError:
        return "nothing"
    place = Path(str(found.locate_file(""))).resolve()
    in_venv = place.is_relative_to(Path(sys.prefix).resolve())
    return "no pin" if in_venv and renew_pins.plain(name) not in pinned else found.version


def unmet(name: str, pinned: set[str]) -> Iterator[str]:
    """Yield what a pinned package needs and neither a pin nor Debian brings."""
    for line in importlib.metadata.requires(name) or []:
        need = Requirement(line)
        if need.marker is not None and not need.marker.evaluate({"extra": ""}):
            continue
        version = version_there(need.name, pinned)
        if version[:2] == "no" or not need.specifier.contains(version, prereleases=True):
            yield f"{name} needs {line}; there is {version}"


def test_what_pinned_packages_need_is_there() -> None:
    """Pip is told to follow no needs: the pins, and Debian's packages, have to be complete."""
    pins = PINS[""]
    assert [t for name in pins for t in unmet(name, set(map(renew_pins.plain, pins)))] == []
    pins = pins | PINS["_farm"] | PINS["_test"]
    wrong = {name: v for name, (v, _) in pins.items() if importlib.metadata.version(name) != v}
    assert wrong == {}, "installed in another version"
    pinned = {renew_pins.plain(name) for name in pins}
    assert [text for name in pins for text in unmet(name, pinned)] == []


def test_no_file_of_the_set_up_names_a_place_to_load_packages_from() -> None:
    """Whoever installs decides: pip's own configuration, or PIP_INDEX_URL."""
    words = ("://", "--index", "--extra-index", "--find-links", " @ ")
    files = [*(ROOT / "setup").glob("*.txt"), ROOT / "setup" / "renew_pins.py"]
    assert [f"{f.name}: {w}" for f in files for w in words if w in f.read_text()] == []


def test_written_pins_are_read_back() -> None:
    """In the order of the alphabet, each hash on its line; the shipped file is written so too."""
    pins = {"Zeta": ("2", [A]), "alpha.b": ("1.0", [A, B])}
    text = renew_pins.pins_text(pins)
    assert renew_pins.read_pins(text) == pins
    assert text.index("alpha.b==1.0 \\\n    --hash=sha256:aaa") < text.index("Zeta==2")
    assert {k: renew_pins.pins_text(pins, KINDS[k]) for k, pins in PINS.items()} == TEXTS


@pytest.mark.parametrize(
    ("text", "error"),
    [
        ("x==1", "is not name==version --hash"),
        (f"x>=1 --hash=sha256:{A}", "is not name==version --hash"),
        (f"x==1 --hash=sha256:{A[1:]}", "is not name==version --hash"),
        (f"x==1 --hash=md5:{A}", "is not name==version --hash"),
        (f"a.b==1 --hash=sha256:{A}\nA-B==1 --hash=sha256:{A}", "A-B is pinned twice"),
    ],
)
def test_line_without_a_hash_or_twice_is_refused(text: str, error: str) -> None:
    """The text names it."""
    with pytest.raises(renew_pins.PinsError, match=error):
        renew_pins.read_pins(text)


def test_pins_are_taken_from_the_report_of_pip() -> None:
    """Name and version as the package itself says, the hash of the file that pip chose."""
    files = {"archive_info": {"hashes": {"sha256": A}}}
    item = {"metadata": {"name": "PyX", "version": "1.0"}, "download_info": files}
    assert renew_pins.pins_of_report({"install": [item]}) == {"PyX": ("1.0", [A])}


def test_renewal_keeps_what_is_pinned_and_lets_requirements_decide() -> None:
    """Nothing is upgraded that nobody asked for."""
    pins = {"Asked.Name": ("1", [A]), "brought-along": ("2", [A])}
    assert renew_pins.kept_versions(pins, "asked-name==3 # new\n") == "brought-along==2\n"


def test_same_version_as_another_file_is_not_written() -> None:
    """The text names the package, both hashes and the way out."""
    with pytest.raises(renew_pins.PinsError, match=rf"x==1 is another .* {B} instead of {A}"):
        renew_pins.merge({"X": ("1", [A])}, {"x": ("1", [B])})


def test_known_hashes_are_kept_and_a_new_version_brings_its_own() -> None:
    """A second hash was added on purpose, for another build of the same version."""
    old = {"x": ("1", [A, B]), "gone": ("1", [A])}
    assert renew_pins.merge(old, {"x": ("1", [B])}) == {"x": ("1", [A, B])}
    assert renew_pins.merge(old, {"x": ("2", [B])}) == {"x": ("2", [B])}


def test_wrong_hash_is_told_with_the_package_and_what_to_do(tmp_path: Path) -> None:
    """The first words are the package's; a mirror and an edited file are the likely causes."""
    (tmp_path / "pip.log").write_text(MISMATCH)
    told = installed_by("advise_python pip.log", tmp_path).stdout
    assert told.startswith("The file that came for msgspec==0.22.0 is not the one")
    assert "git diff setup/pins.txt" in told and "PIP_INDEX_URL" in told


def test_other_failures_ask_for_the_network(tmp_path: Path) -> None:
    """As before."""
    (tmp_path / "pip.log").write_text("ERROR: No matching distribution found for x==1\n")
    assert "Is this machine online?" in installed_by("advise_python pip.log", tmp_path).stdout


def test_requirement_without_a_pin_ends_the_set_up(tmp_path: Path) -> None:
    """It would be left out silently."""
    script = "echo new-one==1 >> setup/requirements.txt; step_python; echo not reached"
    done = installed_by(script, tmp_path)
    assert done.returncode == 1 and "not reached" not in done.stdout
    assert "asks for new-one==1, which setup/pins.txt does not hold" in done.stderr
    assert "setup/renew_pins.py" in done.stderr


def wheel(folder: Path) -> str:
    """Write the smallest wheel that pip installs, and return its SHA-256."""
    path = folder / "tiny-1.0-py3-none-any.whl"
    with zipfile.ZipFile(path, "w") as archive:
        info = "tiny-1.0.dist-info"
        archive.writestr("tiny.py", "")
        archive.writestr(f"{info}/METADATA", "Metadata-Version: 2.1\nName: tiny\nVersion: 1.0\n")
        archive.writestr(f"{info}/WHEEL", "Wheel-Version: 1.0\nTag: py3-none-any\n")
        archive.writestr(f"{info}/RECORD", "")
    return hashlib.sha256(path.read_bytes()).hexdigest()


@pytest.mark.slow
@pytest.mark.thorough
def test_file_with_another_hash_is_not_installed_even_over_the_same_version(tmp_path: Path) -> None:
    """Real pip, on a wheel of the test's own: the right hash passes, then a wrong one fails."""
    digest = wheel(tmp_path)
    wrong = ("0" if digest[0] != "0" else "1") + digest[1:]
    script = f"""
    echo > setup/requirements.txt
    echo "tiny==1.0 --hash=sha256:{digest}" > setup/pins.txt
    step_python && .venv/bin/python -c 'import tiny' && echo installed
    echo "tiny==1.0 --hash=sha256:{wrong}" > setup/pins.txt
    step_python; echo not reached
    """
    done = installed_by(script, tmp_path)
    assert "installed" in done.stdout and "not reached" not in done.stdout, done.stderr
    assert done.returncode == 1
    assert "The file that came for tiny==1.0 is not the one" in done.stderr
