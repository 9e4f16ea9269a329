"""bringup.yaml and the addresses of the servers."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from harness.workspace import ROOT
from harness.yaml_files import shipped
from scara_bringup.config import Ports, load_bringup, load_doors
from scara_bringup.processes.configuration_io import copy_with_ports
from scara_config import ConfigError, files_in_force, load

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


def test_copy_without_wishes_is_the_original(tmp_path: Path) -> None:
    """No port given, no file touched."""
    copied = copy_with_ports(CONFIG, tmp_path / "config")
    for name, file in files_in_force(CONFIG).items():
        assert (copied / name).read_bytes() == file.read_bytes()
