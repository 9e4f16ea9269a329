"""``rosrun what_if improve``: exit codes, the file it writes, and PALLETISE by night."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from harness.running.thorough import SEARCH
from harness.yaml_files import CONFIG
from scara_config.programs.files import program_files, read_listing
from scara_config.programs.tp.listing import MotionLine
from typer.testing import CliRunner
from what_if.improving.descent import Found
from what_if.improving.improve_io import Improver
from what_if.improving.improve_node import app
from what_if.improving.telling import Proof
from what_if.uncertainty.chances import Tried, chances_of
from what_if.verdict import Cause, Outcome, Verdict

PLANT = re.compile(r"^(ideal|field) .* ([\d.]+) % quicker$", re.MULTILINE)


def run(*words: str) -> tuple[int, str]:
    """Run the command; return its exit code and all that it wrote."""
    done = CliRunner().invoke(app, ["--config-dir", str(CONFIG), *words])
    return done.exit_code, done.output


def copied(name: str, folder: Path) -> Path:
    """Return a copy of a shipped program."""
    path = folder / f"{name}.LS"
    path.write_text(program_files(CONFIG)[name].read_text())
    return path


@pytest.mark.thorough
def test_a_shipped_program_gets_a_quicker_one_beside_it(tmp_path: Path) -> None:
    """On both plants, with its remarks; a second time nothing is overwritten."""
    path = copied("TWO_POINT", tmp_path)
    words = (str(path), "--tries", "1", "--worlds", "3", "--workers", "1")
    code, text = run(*words)
    assert code == 0, text
    old, new = read_listing(path), read_listing(tmp_path / "TWO_POINT_2.LS")
    assert [plant for plant, _ in PLANT.findall(text)] == ["ideal", "field"]
    assert all(float(share) > 5.0 for _, share in PLANT.findall(text))
    assert "0 collisions in 3 that differ (seed 0)" in text
    assert new.positions == old.positions and len(new.lines) == len(old.lines)
    for one, other in zip(old.lines, new.lines):
        assert one == other or isinstance(one, MotionLine)
    code, text = run(*words)
    assert code == 2 and "TWO_POINT_2.LS: is there already: name another by --out" in text
    if not SEARCH:
        return
    # What was improved has nothing left.
    again = run(str(tmp_path / "TWO_POINT_2.LS"), *words[1:])
    assert again[0] == 1 and "nothing better was found: TWO_POINT_2 stays as it is" in again[1]


def test_a_file_that_came_meanwhile_is_not_written_over(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The search takes minutes; what it found is printed."""
    path, other = copied("TWO_POINT", tmp_path), tmp_path / "TWO_POINT_2.LS"

    def search(improver: Improver, *_: object) -> list[Found]:
        other.write_text("of somebody else")
        return [Found([None] * len(improver.choices), 0.0)]

    def proof(improver: Improver, *_: object) -> Proof:
        verdict = improver.bench.verdict
        return Proof({}, verdict, verdict, (1.0, 1.0), None, None, 0.5)

    monkeypatch.setattr(Improver, "search", search)
    monkeypatch.setattr(Improver, "proof", proof)
    code, text = run(str(path))
    assert code == 2 and "TWO_POINT_2.LS: is there already" in text
    assert "/PROG  TWO_POINT_2" in text and other.read_text() == "of somebody else"


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("NOPE",), "there are ARTICLE, DOCKWTCH, PALLETISE, TWO_POINT, VEHICLE"),
        (("ARTICLE", "--out", "it.txt"), "a program's file ends with .LS"),
        (("ARTICLE", "--out", "/missing/X.LS"), "/missing is no folder that can be written"),
        (("ARTICLE", "--tries", "0"), "--tries"),
    ],
)
def test_a_wrong_word_is_said(words: tuple[str, ...], said: str) -> None:
    """With exit code 2."""
    code, text = run(*words)
    assert code == 2 and said in text, text


def test_a_program_that_a_plant_does_not_end_is_not_proven() -> None:
    """It is not enough that geometry allows it."""
    fine = Verdict(Outcome.OK)
    proof = Proof({"field": (None, None)}, fine, fine, (1.0, 1.0), None, None, 0.5)
    assert proof.fault == "field: the program does not come to its end"


def test_a_program_that_drops_a_part_in_some_worlds_is_not_proven() -> None:
    """Nothing hits anything there, and still it is refused."""
    fine = Verdict(Outcome.OK)
    found = [Tried((), "", 2.0, 1.0)] * 3 + [Tried((Cause.DROP,), "", 2.0, 1.0)]
    worlds = chances_of(found, (), 0)
    proof = Proof({}, fine, fine, (1.0, 1.0), None, worlds, 0.5)
    assert proof.fault == "25 % of the worlds: drop"


@pytest.mark.thorough
@pytest.mark.timeout(1800)  # by night it has what live scenes beside it leave of the processor
def test_palletise_is_a_quarter_quicker(tmp_path: Path) -> None:
    """On both plants, nine of nine parts placed, no collision in a hundred worlds."""
    path = copied("PALLETISE", tmp_path)
    code, text = run(str(path), "--tries", "2")
    assert code == 0, text
    assert [plant for plant, share in PLANT.findall(text) if float(share) >= 25.0] == [
        "ideal",
        "field",
    ]
    assert text.count("9 of 9 parts placed") == 2
    assert "0 collisions in 100 that differ" in text
    lines = read_listing(tmp_path / "PALLETISE_2.LS").lines
    assert len(lines) == len(read_listing(path).lines)
