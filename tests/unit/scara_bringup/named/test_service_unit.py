"""The service unit of a cell is one that systemd takes, and is never enabled by us."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from harness.workspace import ROOT
from scara_bringup.cell_node import app
from scara_bringup.named import install_node
from scara_bringup.named import service_file_io as service_file
from scara_bringup.named.install_node import install_cell
from scara_bringup.named.service_file_io import InstallError, refusal, remove_unit, write_unit
from scara_bringup.named.service_unit import Service, unit_text
from scara_config.profile import CHOICE
from typer.testing import CliRunner

MILK = Service("milk_2", ROOT, ("--farm",))


@pytest.mark.parametrize("user", ["", "root"])
def test_systemd_takes_the_unit(tmp_path: Path, user: str) -> None:
    """As it is written, of a person and of the machine."""
    path = write_unit(Service("milk_2", ROOT, ("--farm",), user), tmp_path)
    assert refusal(path) == ""
    assert [each.name for each in tmp_path.iterdir()] == ["cell-milk_2.service"]


def test_the_unit_starts_the_cell_by_its_name_and_again_after_a_crash() -> None:
    """But not again and again with a wrong configuration, and without a browser."""
    text = unit_text(MILK)
    assert f"ExecStart={ROOT}/cell up --name milk_2 --no-browser --farm\n" in text
    assert "Restart=on-failure\n" in text and "RestartPreventExitStatus=2\n" in text
    assert "WantedBy=default.target\n" in text and "User=" not in text
    machine = unit_text(Service("milk_2", ROOT, (), "ann"))
    assert "User=ann\n" in machine and "WantedBy=multi-user.target\n" in machine


def test_what_systemd_refuses_changes_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The old unit stays, and the text says why."""
    path = write_unit(MILK, tmp_path)
    monkeypatch.setattr(service_file, "refusal", lambda _: "unknown type")
    with pytest.raises(InstallError, match="nothing was changed; systemd refuses it: unknown type"):
        write_unit(Service("milk_2", Path("/elsewhere")), tmp_path)
    assert str(ROOT) in path.read_text(encoding="utf-8")


def test_a_fault_is_found_by_systemd(tmp_path: Path) -> None:
    """The check can fail."""
    path = tmp_path / "cell-x.service"
    path.write_text(unit_text(MILK).replace("Type=exec", "Type=exe"), encoding="utf-8")
    assert "service type" in refusal(path)


def test_install_says_what_to_do_next_and_enables_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Written, then removed; systemctl is never called."""
    monkeypatch.setenv("CELL_ROOT", str(ROOT))
    monkeypatch.setenv(CHOICE, "fanuc_sr6ia")  # what install_cell leaves there is put back
    assert install_cell("milk_2", ["--farm"], False, tmp_path, False) == 0
    said = capsys.readouterr().out
    assert "Nothing was enabled" in said and "enable --now cell-milk_2.service" in said
    assert install_cell("milk_2", [], False, tmp_path, True) == 0
    assert list(tmp_path.iterdir()) == []
    assert install_cell("milk_2", [], False, tmp_path, True) == 1
    assert install_cell("two words", [], False, tmp_path, False) == 2
    assert install_cell("milk_2", ["--robot", "nobody"], False, tmp_path, False) == 2


def test_the_unit_of_a_real_robots_cell_leaves_out_the_stand_in(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As `up` does; the cell would be refused at each start."""
    monkeypatch.setenv("CELL_ROOT", str(ROOT))
    words = ["install", "milk_2", "--without", "emulator", "--farm", "--folder", str(tmp_path)]
    done = CliRunner().invoke(app, words)
    assert done.exit_code == 0, done.output
    text = (tmp_path / "cell-milk_2.service").read_text(encoding="utf-8")
    assert "--name milk_2 --no-browser --without emulator --farm\n" in text


@pytest.mark.parametrize(
    ("uid", "caller", "user"), [(0, "ann", "ann"), (0, "", "root"), (1000, "bob", "root")]
)
def test_the_unit_of_a_machine_runs_as_who_called_sudo(
    uid: int, caller: str, user: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nodes of root would write recordings that nobody else may delete."""
    monkeypatch.setenv("CELL_ROOT", str(ROOT))
    monkeypatch.setenv(CHOICE, "fanuc_sr6ia")
    monkeypatch.setenv("LOGNAME", "root")
    monkeypatch.setenv("SUDO_USER", caller)
    monkeypatch.setattr(os, "geteuid", lambda: uid)
    wrote: list[Service] = []

    def write(service: Service, folder: Path) -> Path:
        wrote.append(service)
        return folder

    monkeypatch.setattr(install_node, "write_unit", write)
    assert install_cell("milk_2", [], True, tmp_path, False) == 0
    assert [service.user for service in wrote] == [user]


def test_a_folder_that_cannot_be_written_to_is_told(tmp_path: Path) -> None:
    """With what to do."""
    (tmp_path / "file").write_text("x")
    with pytest.raises(InstallError, match="--folder names another place"):
        write_unit(MILK, tmp_path / "file")
    with pytest.raises(InstallError, match="No such file"):
        remove_unit(MILK, tmp_path)
