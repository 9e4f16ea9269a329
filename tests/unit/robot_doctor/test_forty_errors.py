"""Each of 40 planted errors is named with its file, line and remedy, all in one round.

What another one hides is planted alone; thoroughly each of them is.
"""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest
from harness.forty_errors import ALONE, BIG, FORTY, SMALL, Planted, robot
from harness.running.thorough import thorough
from harness.workspace import ROOT
from robot_doctor.doctor_node import other_files
from robot_doctor.examine import examine
from robot_doctor.finding import Finding, Level
from robot_doctor.profile_files_io import place_of, read_profile
from scara_config.profile import CHOICE


@pytest.fixture
def config(tmp_path: Path) -> Path:
    """Give a copy of the whole configuration."""
    shutil.copytree(ROOT / "config", tmp_path / "config")
    return tmp_path / "config"


def plant(config: Path, error: Planted) -> None:
    """Make the error."""
    file = config / "robots" / error.robot / error.file
    text = file.read_text()
    assert error.old in text, error
    file.write_text(text.replace(error.old, error.new, 1))


def told(config: Path) -> list[tuple[Finding, str]]:
    """Return what one round of the doctor finds wrong, and where."""
    profile = read_profile(config)
    found = list(examine(profile))
    found += other_files(config, profile, found)
    wrong = [finding for finding in found if finding.level is Level.WRONG]
    return [(finding, place_of(finding, config, profile.robot)) for finding in wrong]


def test_there_are_forty() -> None:
    """As many as were asked for."""
    assert len(FORTY) >= 40


def place(config: Path, error: Planted) -> str:
    """Return where an error is to be told."""
    file, text = error.there if error.there[0] else (error.file, error.new)
    path = config / "robots" / error.robot / file
    if file.endswith(".urdf"):
        path = ROOT / "src" / "scara_description" / "urdf" / file
    whole = path.read_text()
    return f"{path}:{whole[: whole.index(text)].count(chr(10)) + 1}"


def named(found: list[tuple[Finding, str]], error: Planted) -> list[tuple[str, str]]:
    """Return advice and place of the findings that are of an error."""
    return [(f.advice, at) for f, at in found if re.search(error.what, f.what)]


@pytest.mark.parametrize(
    "name", [*ALONE, *thorough(*(name for name in FORTY if name not in ALONE))]
)
def test_a_planted_error_is_named_with_file_line_and_remedy(
    config: Path, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Once, at the line that was changed or where it is to be written."""
    error = FORTY[name]
    monkeypatch.setenv(CHOICE, error.robot)
    plant(config, error)
    found = told(config)
    ((advice, at),) = named(found, error)
    assert re.search(error.remedy, advice), advice
    assert at == place(config, error)
    assert len({finding.what for finding, _ in found}) == len(found), "each is told once"


@pytest.mark.parametrize("name", [BIG, SMALL])
def test_all_of_them_are_named_in_one_round(
    config: Path, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """None waits for another one to be mended; each at its line, with its remedy."""
    monkeypatch.setenv(CHOICE, name)
    planted = {key: e for key, e in FORTY.items() if e.robot == name and key not in ALONE}
    for error in planted.values():
        plant(config, error)
    found = told(config)
    for key, error in planted.items():
        places = [at for advice, at in named(found, error) if re.search(error.remedy, advice)]
        assert place(config, error) in places, (key, named(found, error))


def test_all_values_that_are_given_have_one_elbow(
    config: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Shorter, the arm does not reach P1; from P2 to P3 it would have to turn over otherwise."""
    monkeypatch.setenv(CHOICE, BIG)
    plant(config, robot("l1_mm: 350.0", "l1_mm: 325.0", "", ""))
    found = {f.what[:19]: f.advice for f, _ in told(config) if f.what.startswith("ARTICLE.LS")}
    turned = [
        float(re.search(r"J2= (\S+) deg", found[f"ARTICLE.LS: P[{k}:P{k}]"])[1]) for k in (2, 3)
    ]
    assert turned == pytest.approx([62.48873, 62.48873], abs=1e-5)


def test_half_the_inertia_in_a_typed_urdf_is_found(
    config: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The command that computes it is named; a tenth more is somebody's better knowledge."""
    monkeypatch.setenv(CHOICE, BIG)
    urdf = tmp_path / "scara_cell.urdf"
    before = (ROOT / "src" / "scara_description" / "urdf" / urdf.name).read_text()
    monkeypatch.setattr("scara_config.robot.description_path", tmp_path.joinpath)
    link = before.index('<link name="link_2">')
    begin = before.index("<inertia ", link)
    end = before.index("/>", begin)
    typed = {key: float(x) for key, x in re.findall(r'(\w+)="(.*?)"', before[begin:end])}
    for factor, count in ((0.5, 1), (1.1, 0)):
        terms = " ".join(f'{key}="{factor * value}"' for key, value in typed.items())
        urdf.write_text(f"{before[:begin]}<inertia {terms}{before[end:]}")
        found = told(config)
        assert len(found) == count, found
        for finding, at in found:
            assert finding.what.startswith("link link_2: the inertia of ")
            assert finding.advice == f"rosrun scara_description write_inertia {urdf}"
            assert at == f"{urdf}:{before[:link].count(chr(10)) + 1}"
