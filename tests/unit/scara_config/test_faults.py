"""Everything that is wrong in a file is told at once, with its line and what was meant."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated, Literal

import msgspec
import pytest
from harness.yaml_files import copy_configuration
from msgspec import Meta
from scara_config import ConfigError, load
from scara_config.readers import check_files, with_line

Speed = Annotated[float, Meta(ge=1.0, le=100.0)]


class Axis(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A part of the example."""

    name: str
    speed_percent: Speed
    kind: Literal["revolute", "prismatic"] = "revolute"


class Round(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag="round", tag_field="form"):
    """One of two forms."""

    radius: float


class Square(
    msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag="square", tag_field="form"
):
    """The other one."""

    side: float


class Example(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """An example of a configuration."""

    rate_hz: Annotated[int, Meta(gt=0)]
    axes: list[Axis]
    gains: dict[str, float] = {}
    form: Round | Square | None = None
    point: tuple[float, float] | None = None
    name: Annotated[str, Meta(min_length=2)] | None = None


def refusal(folder: Path, text: str) -> list[str]:
    """Return the lines of the error that a text gets."""
    file = folder / "example.yaml"
    file.write_text(text)
    with pytest.raises(ConfigError) as caught:
        load(file, Example)
    return [line.removeprefix(f"{file}: ") for line in str(caught.value).splitlines()]


AXES = "axes:\n  - {name: a, speed_percent: 50}\n"


@pytest.mark.parametrize(
    ("text", "line"),
    [
        (
            f"rate_hx: 5\n{AXES}",
            "(top level) = {rate_hx, axes}: Object contains unknown field `rate_hx` "
            "(line 1; did you mean `rate_hz`?)",
        ),
        (
            "rate_hz: 1\naxes:\n  - name: a\n    speed_percnt: 50\n",
            "axes[0] = {name, speed_percnt}: Object contains unknown field `speed_percnt` "
            "(line 4; did you mean `speed_percent`?)",
        ),
        (
            f"rate_hz: 1\n{AXES}\nzebra: 1\n",
            "(top level) = {rate_hz, axes, zebra}: Object contains unknown field `zebra` (line 5)",
        ),
        (
            "rate_hz: 1\naxes:\n  - name: a\n    speed_percent: 1\n    kind: revolut\n",
            "axes[0].kind = 'revolut': Invalid enum value 'revolut', allowed are revolute, "
            "prismatic (line 5; did you mean `revolute`?)",
        ),
        (
            "rate_hz: 1\naxes:\n  - name: a\n    speed_percent: 1\n    kind: {revolute: 1}\n",
            "axes[0].kind = {revolute}: Expected `str`, got `object`, allowed are revolute, "
            "prismatic (line 5)",
        ),
        (
            f"rate_hz: 1\n{AXES}gains:\n  p: 1\n  i: high\n",
            "gains.i = 'high': Expected `float`, got `str` (line 6)",
        ),
        (
            f"rate_hz: 1\n{AXES}form:\n  form: square\n  radius: 2\n",
            "form = {form, radius}: Object contains unknown field `radius` (line 6)",
        ),
        (
            f"rate_hz: 1\n{AXES}point: [1, x]\n",
            "point[1] = 'x': Expected `float`, got `str` (line 4)",
        ),
        (
            f"rate_hz: 1\n{AXES}point: [1, 2, 3]\n",
            "point = [1, 2, 3]: Expected `array` of length 2, got 3 (line 4)",
        ),
        (f"rate_hz: 1\n{AXES}name: x\n", "name = 'x': Expected `str` of length >= 2 (line 4)"),
    ],
)
def test_a_fault_has_its_line_and_what_was_meant(tmp_path: Path, text: str, line: str) -> None:
    """The key that was mistyped is shown; the one that is missing because of it is not."""
    assert line in refusal(tmp_path, text)


def test_a_mistyped_key_is_one_fault(tmp_path: Path) -> None:
    """It is unknown, and the right one is missing: that is one mistake."""
    assert len(refusal(tmp_path, f"rate_hx: 5\n{AXES}")) == 1


def test_all_faults_of_a_file_come_at_once(tmp_path: Path) -> None:
    """Nobody wants to start a cell five times to find five mistakes."""
    text = (
        "rate_hz: 0\naxes:\n  - {name: 7, speed_percent: 500}\n  - {speed_percent: 5}\n"
        "gains: {p: x, i: 1, d: y}\n"
    )
    lines = refusal(tmp_path, text)
    keys = [line.partition(" = ")[0] for line in lines]
    assert keys == ["rate_hz", "axes[0].name", "axes[0].speed_percent", "axes[1]"] + [
        "gains.p",
        "gains.d",
    ]
    assert all("(line " in line for line in lines)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("a: [1, 2\n", "(line 2, column 1, near `a`)"),
        ("rate_hz: 1\nrate_hz: 2\n", "duplicate key"),
        ("\tx: 1\n", "(line 1, column 1, near `x`)"),
    ],
)
def test_broken_yaml_is_one_line_with_line_and_column(tmp_path: Path, text: str, said: str) -> None:
    """Not the parser's own picture of it over five lines."""
    (line,) = refusal(tmp_path, text)
    assert "is no valid YAML: " in line and said in line


def test_all_faults_of_a_cell_come_at_once(tmp_path: Path) -> None:
    """Of every file; what depends on a wrong robot.yaml is named."""
    folder = copy_configuration(tmp_path / "config")
    for name, right, false in (
        ("gateway.yaml", "port: 9090", "prot: 9090"),
        ("motion.yaml", "speed_percent:", "sped_percent:"),
        ("twin_controller.yaml", "poll_period_ms:", "poll_periode_ms:"),
    ):
        text = (folder / name).read_text()
        assert right in text
        (folder / name).write_text(text.replace(right, false, 1))
    begun = time.process_time()
    faults = check_files(folder)
    assert time.process_time() - begun < 5.0  # a bound for a busy machine; idle it takes 0.6 s
    for file, meant in (
        ("gateway", "port"),
        ("motion", "default_speed_percent"),
        ("twin_controller", "poll_period_ms"),
    ):
        assert any(f"{file}.yaml: " in one and f"did you mean `{meant}`" in one for one in faults)
    assert all("(line " in one for one in faults) and len(faults) == 3
    (folder / "robot.yaml").write_text("name: 5\n")
    assert "what depends on it was not checked: body.yaml, emulator.yaml" in check_files(folder)[-1]


def test_a_files_own_rule_gets_its_line_too(tmp_path: Path) -> None:
    """Such a rule is judged after the file was read, and knows no lines."""
    folder = copy_configuration(tmp_path / "config")
    text = (folder / "robot.yaml").read_text()
    file = folder / "robot.yaml"
    number = next(n for n, line in enumerate(text.splitlines(), 1) if line.startswith("home:"))
    assert with_line(f"{file}: home = 5: is wrong") == f"{file}: home = 5: is wrong (line {number})"
    assert with_line(f"{file}: nothing like a key") == f"{file}: nothing like a key"
    assert with_line("port 5 is taken") == "port 5 is taken"
