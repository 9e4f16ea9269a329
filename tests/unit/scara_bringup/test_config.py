"""bringup.yaml and the addresses of the servers."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from harness.workspace import ROOT
from harness.yaml_files import copy_configuration, shipped
from scara_bringup.config import Ports, load_bringup, load_doors
from scara_bringup.processes.configuration_io import (
    begin_with_change,
    copy_with_ports,
    link_taught,
)
from scara_config import ConfigError, files_in_force, load
from scara_config.frames import TaughtFrame, find_frames, save_frame
from scara_config.loader import load_keys
from scara_config.profile import CHOICE
from scara_config.programs.files import program_files
from scara_config.programs.keeping import keep_program
from scara_config.rollout.change import Change
from scara_config.rollout.kept import RUNNING, Kept, kept_file, read_kept, write_kept

CONFIG = ROOT / "config"


def test_graces_are_long_enough_for_a_clean_end_and_short_enough_for_a_person() -> None:
    """Loads the shipped file; a Ctrl-C ends a healthy cell long before these."""
    deadlines = load_bringup(CONFIG)
    assert deadlines.terminate_grace <= deadlines.interrupt_grace <= 15.0


def test_missing_file_is_named(tmp_path: Path) -> None:
    """The text names the file that is looked for."""
    with pytest.raises(ConfigError, match=r"bringup\.yaml: cannot be read"):
        load_bringup(tmp_path)


@pytest.mark.parametrize("port", ["0", "65536", "'9090'"])
def test_impossible_port_is_refused(tmp_path: Path, port: str) -> None:
    """File, key and value are in the text."""
    for file in ("emulator.yaml", "operator_panel.yaml", "pendant_page.yaml"):
        shutil.copy(shipped(file), tmp_path)
    (tmp_path / "gateway.yaml").write_text(f"host: 127.0.0.1\nport: {port}\n")
    with pytest.raises(ConfigError, match=r"gateway\.yaml: port = "):
        load_doors(tmp_path)


def test_copy_with_ports_changes_both_ends_and_nothing_else(tmp_path: Path) -> None:
    """Server and client of each link agree, every other value stays, comments too."""
    copied = copy_with_ports(CONFIG, tmp_path / "config", Ports(15021, 19091, 18081, 18091))
    doors = load_doors(copied)
    assert (doors.modbus.port, doors.gateway.port) == (15021, 19091)
    assert (doors.panel.port, doors.pendant.port) == (18081, 18091)
    assert Ports(gateway=7).over(doors).gateway.port == 7
    before, after = (
        load(CONFIG / "twin_controller.yaml", dict),
        load(copied / "twin_controller.yaml", dict),
    )
    assert after["real"]["port"] == 15021 and after["twin"]["url"] == "ws://127.0.0.1:19091"
    after["real"]["port"], after["twin"]["url"] = before["real"]["port"], before["twin"]["url"]
    assert after == before
    assert (copied / "twin_controller.yaml").read_text().count("#") == (
        CONFIG / "twin_controller.yaml"
    ).read_text().count("#")
    assert files_in_force(copied).keys() == files_in_force(CONFIG).keys()


def test_a_change_of_another_robot_waits_until_the_cell_has_that_one_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What was proven with one robot is a guess for another; the cell's name is the same."""
    file, change = kept_file(tmp_path, "milk_1"), Change("stiff", {"pid_gains.yaml": {"a": 1.0}})
    monkeypatch.setenv(CHOICE, "fanuc_sr6ia")
    write_kept(file, Kept().offered(change, "ann@d").start().ready())
    before = file.read_bytes()
    monkeypatch.setenv(CHOICE, "epson_gx4")
    kept = begin_with_change(file, CONFIG)
    assert kept.wanted is None and "is for fanuc_sr6ia, this cell has epson_gx4" in kept.note
    assert file.read_bytes() == before
    other = kept.offered(change, "bob@d")
    assert (other.number, other.robot, other.before) == (2, "epson_gx4", None)
    monkeypatch.setenv(CHOICE, "fanuc_sr6ia")
    assert read_kept(file).wanted == change
    # One that was kept before robots were told apart.
    file.write_text('{"number":1,"wanted":{"name":"old","values":{}}}')
    monkeypatch.setenv(CHOICE, "epson_gx4")
    assert read_kept(file).wanted == Change("old", {})


def test_copy_without_wishes_is_the_original(tmp_path: Path) -> None:
    """No port given, no file touched."""
    copied = copy_with_ports(CONFIG, tmp_path / "config")
    for name, file in files_in_force(CONFIG).items():
        assert (copied / name).read_bytes() == file.read_bytes()


@pytest.mark.parametrize("taught_before", [True, False])
def test_what_is_taught_in_a_copy_is_there_at_the_next_start(
    tmp_path: Path, taught_before: bool
) -> None:
    """A cell with a name or a port reads a copy; frames, programs and numbers are saved in both."""
    (tmp_path / "source").mkdir()
    source = copy_configuration(tmp_path / "source")
    if not taught_before:
        (source / "frames.yaml").unlink()
    known = files_in_force(source).keys()
    copied = copy_with_ports(source, tmp_path / "config", Ports(gateway=19091))
    link_taught(source, copied)
    assert files_in_force(copied).keys() == known
    assert find_frames(copied) == find_frames(source)
    frame = TaughtFrame("corner", (1.0, 2.0, 3.0))
    save_frame(copied, "user", 3, frame)
    text = program_files(copied)["ARTICLE"].read_text().replace("/PROG  ARTICLE", "/PROG  MINE")
    for _ in range(2):
        keep_program("MINE", text, copied)
    again = copy_with_ports(source, tmp_path / "again")
    for folder in (source, copied, again):
        assert find_frames(folder).numbered("user")[3] == frame
        assert program_files(folder)["MINE"].read_text() == text
        (numbered,) = load_keys(folder / "emulator.yaml", {"rsr_programs": list[str]})
        assert numbered[-1] == "MINE" and numbered.count("MINE") == 1
    assert load_doors(source).gateway.port != 19091


def test_a_second_start_in_the_same_folder_writes_into_no_other_robots_files(
    tmp_path: Path,
) -> None:
    """What people teach in a copy is saved in the original, which another robot's is not."""
    sources = []
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        sources.append(copy_configuration(tmp_path / name))
        save_frame(sources[-1], "user", 3, TaughtFrame(name, (1.0, 2.0, 3.0)))
    before = {file: file.read_bytes() for file in files_in_force(sources[0]).values()}
    copied = tmp_path / "output" / "config"
    for source in (*sources, sources[1]):
        assert copy_with_ports(source, copied, Ports(gateway=19091)) == copied
        link_taught(source, copied)
        assert find_frames(copied).numbered("user")[3].name == source.name
    assert before == {file: file.read_bytes() for file in before}


def test_a_second_start_in_the_same_folder_keeps_nothing_of_the_first(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Another robot's files, and a change that was taken back, would be in force."""
    (tmp_path / "first").mkdir()
    source = copy_configuration(tmp_path / "first")
    before = files_in_force(source)
    copied = copy_with_ports(source, tmp_path / "config")
    link_taught(source, copied)
    (copied / RUNNING).write_text("{}")
    monkeypatch.setenv(CHOICE, "epson_gx4")
    copy_with_ports(CONFIG, copied)
    assert files_in_force(copied).keys() == files_in_force(CONFIG).keys()
    assert not (copied / RUNNING).exists() and files_in_force(source) == before


def test_a_start_that_reads_its_own_copy_keeps_it_and_takes_other_ports(tmp_path: Path) -> None:
    """Whoever has typed what a cell says, export SCARA_CONFIG_DIR=..., and starts it again."""
    source = copy_configuration(tmp_path)
    copied = copy_with_ports(source, tmp_path / "config", Ports(gateway=19091))
    link_taught(source, copied)
    again = copy_with_ports(copied, copied, Ports(gateway=19092))
    link_taught(again, copied)
    assert load_doors(copied).gateway.port == 19092
    assert program_files(copied).keys() == program_files(source).keys()
    save_frame(copied, "user", 3, TaughtFrame("corner", (1.0, 2.0, 3.0)))
    assert find_frames(source).numbered("user")[3].name == "corner"
