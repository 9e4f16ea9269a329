"""A program becomes one of the robot's: whole, with a number, or nothing changes."""

from __future__ import annotations

from pathlib import Path

import pytest
from fanuc_emulator.config import load_programs
from harness.yaml_files import CONFIG, changed_yaml, copy_configuration, shipped
from scara_config import ConfigError, load_robot
from scara_config.loader import load_keys
from scara_config.programs.keeping import keep_program, kept_file

TEXT = shipped("programs/TWO_POINT.LS").read_text(encoding="utf-8").replace("TWO_POINT", "MINE")
(NUMBERED,) = load_keys(shipped("emulator.yaml"), {"rsr_programs": list[str]})


@pytest.fixture
def config(tmp_path: Path) -> Path:
    """Return a configuration of its own."""
    return copy_configuration(tmp_path)


def numbered(config: Path) -> list[str]:
    """Return which programs have a number."""
    (found,) = load_keys(config / "emulator.yaml", {"rsr_programs": list[str]})
    return list(found)


def test_saved_program_is_one_of_the_robots_with_the_next_number(config: Path) -> None:
    """Once more: the text is new, the number stays, and so does each comment of emulator.yaml."""
    assert keep_program("MINE", TEXT, config) == f"MINE.LS: saved, RSR{len(NUMBERED) + 1}"
    again = TEXT.replace("there and back", "here and there")
    assert keep_program("MINE", again, config) == "MINE.LS: saved"
    assert numbered(config) == [*NUMBERED, "MINE"]
    program = load_programs(load_robot(config), config)[len(NUMBERED) + 1]
    assert (program.name, program.flow.program.comment) == ("MINE", "here and there")
    old, new = ((folder / "emulator.yaml").read_text() for folder in (shipped_folder(), config))
    assert old.count("#") == new.count("#") and len(old.splitlines()) == len(new.splitlines())


def shipped_folder() -> Path:
    """Return where the shipped emulator.yaml is."""
    return shipped("emulator.yaml").parent


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("A_NAME_OF_17_SIGN", "16 signs at most"),
        ("mine", "begins with a capital letter, then come capital letters, digits and _"),
        ("RSR0101", "is the stream's program"),
    ],
)
def test_program_that_cannot_have_a_number_is_not_written(
    config: Path, name: str, said: str
) -> None:
    """The cell starts as before."""
    with pytest.raises(ConfigError, match=said):
        keep_program(name, TEXT.replace("MINE", name), config)
    assert not kept_file(name, config).exists() and numbered(config) == NUMBERED


def test_program_of_background_logic_gets_no_number(config: Path) -> None:
    """Nothing but SETUP > BG Logic starts it."""
    text = shipped("programs/DOCKWTCH.LS").read_text(encoding="utf-8")
    said = "DOCKWTCH.LS: saved; it counts from the stand-in's next start"
    assert keep_program("DOCKWTCH", text, config) == said
    assert numbered(config) == NUMBERED


def test_ninth_program_is_kept_without_a_number(config: Path) -> None:
    """It can be called; the answer says so."""
    full = [*NUMBERED, *("ARTICLE",) * (8 - len(NUMBERED))]
    changed_yaml(config / "emulator.yaml", config, ["rsr_programs"], full)
    assert "all 8 numbers of emulator.yaml are taken" in keep_program("MINE", TEXT, config)
    assert kept_file("MINE", config).read_text(encoding="utf-8") == TEXT
    assert kept_file("ARTICLE", CONFIG).exists()
