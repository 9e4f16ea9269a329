"""The command line: exit codes, JSON, what it says of a wrong question."""

from __future__ import annotations

import msgspec
import pytest
from harness.yaml_files import CONFIG
from typer.testing import CliRunner
from what_if.judge_node import app
from what_if.verdict import Outcome, Verdict


def run(*words: str) -> tuple[int, str]:
    """Run the command; return its exit code and all that it wrote."""
    done = CliRunner().invoke(app, ["--resting", "--config-dir", str(CONFIG), *words])
    return done.exit_code, done.output


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        (("article",), 0, "OK: takes"),
        (("0.51,0.16,0.10", "--speed", "100"), 1, "LIMITED at 0.00 s"),
        (("0.65,0,-0.02",), 2, "the nozzle would hit part_"),
        (("-0.4,0.3,0.1",), 0, "OK: takes"),
        (("NOPE",), 3, "there are ARTICLE, DOCKWTCH, PALLETISE, TWO_POINT, VEHICLE"),
        (("0.5,0.1",), 3, "expected x,y,z [m]"),
        (("none.bag",), 3, "there is no such bag"),
    ],
)
def test_exit_codes(words: tuple[str, ...], code: int, said: str) -> None:
    """0 OK, 1 LIMITED, 2 REFUSED, 3 no verdict."""
    got, text = run(*words)
    assert got == code, text
    assert said in text


def test_json_is_the_verdict() -> None:
    """What a program reads is what the library gives."""
    code, text = run("0.65,0,-0.02", "--json")
    verdict = msgspec.json.decode(text, type=Verdict)
    assert (code, verdict.outcome) == (2, Outcome.REFUSED)
    assert verdict.reasons[0].text.startswith("the nozzle would hit part_")


@pytest.mark.thorough
def test_worlds_that_differ_are_told_with_their_seed() -> None:
    """Beside the verdict; as JSON too."""
    code, text = run("0.51,0.16,0.10", "--worlds", "5", "--seed", "4", "--workers", "1")
    assert code == 0 and "5 were drawn (seed 4)" in text
    _, text = run("0.51,0.16,0.10", "--worlds", "5", "--seed", "4", "--workers", "1", "--json")
    assert '"worlds": 5' in text and '"collision": 0.0' in text
