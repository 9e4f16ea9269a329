"""What the doctor says of a robot that is only followed."""

from __future__ import annotations

from pathlib import Path

import msgspec
from fanuc_kit.make_node import app as make
from harness.followed import FOLLOW_MAP, four_axes
from harness.workspace import ROOT
from robot_doctor.examine import examine
from robot_doctor.finding import Level
from robot_doctor.profile_files_io import read_profile
from robot_doctor.register_checks import check_registers
from scara_config import load_robot
from twin_controller.config import load_twin_controller
from typer.testing import CliRunner

from robot_doctor import doctor_node

CONFIG = ROOT / "config"
SHIPPED = load_robot(CONFIG)
ROBOT = msgspec.structs.replace(SHIPPED, lead=False)


def test_it_is_said_with_what_stands_in_the_place_of_what_is_left_out() -> None:
    """All is fine: nothing of it is a fault."""
    profile = msgspec.structs.replace(read_profile(CONFIG), robot=ROBOT, layout=FOLLOW_MAP)
    found = list(examine(profile))
    assert {finding.level for finding in found} == {Level.FINE}
    said = [finding.what for finding in found]
    assert "lead is false: the twin follows only, and nothing is ever written to the robot" in said
    assert "velocity is left out: differences of positions, over the robot's clock" in said
    assert "watchdog_state is left out: not shown" in said


def test_a_robot_that_shall_lead_needs_a_map_for_it() -> None:
    """The same map with a profile that does not say lead: false."""
    found = list(check_registers(SHIPPED, FOLLOW_MAP, 2))
    assert any("robot.yaml must say lead: false" in finding.what for finding in found)


def test_it_is_never_asked_to_move() -> None:
    """--move would write: it is refused before anybody connects."""
    profile = msgspec.structs.replace(read_profile(CONFIG), robot=ROBOT)
    nowhere = ("127.0.0.1", 1)
    config = load_twin_controller(ROBOT, CONFIG)
    (found,) = doctor_node._robot(profile, FOLLOW_MAP, config, nowhere, True)
    assert found.level is Level.WRONG and "lead is false" in found.what


def test_a_robot_on_which_no_stop_was_tried_is_never_asked_to_move() -> None:
    """At this address; the advice says what comes before."""
    profile = read_profile(CONFIG)
    config = load_twin_controller(SHIPPED, CONFIG)
    (found,) = doctor_node._robot(profile, profile.layout, config, ("192.0.2.9", 1), True)
    assert found.level is Level.WRONG and "nothing that stopped 192.0.2.9" in found.what
    assert "--stops" in found.advice


def test_a_robot_without_a_table_is_as_good(tmp_path: Path) -> None:
    """All is fine, and its kit has what following needs: two settings, no program, no signal."""
    config = four_axes(tmp_path)
    profile = read_profile(config)
    found = list(examine(profile))
    assert {finding.level for finding in found} == {Level.FINE}, found
    assert "fanuc_sr6ia: 4 joints, 3 of them in the twin" in [finding.what for finding in found]
    kit = tmp_path / "kit"
    done = CliRunner().invoke(make, ["--config-dir", str(config), "--out", str(kit)])
    assert done.exit_code == 0, done.output
    names = {"1_settings.md", "2_slots.md", "5_acceptance.md", "kit.html", "modbus_map.yaml"}
    assert {path.name for path in kit.iterdir()} == names
    settings = (kit / "1_settings.md").read_text()
    assert settings.count("☐") == 2 and "$NUM_MODBUS" in settings
    assert (
        "STOP on the page: the twin stands, the robot goes on"
        in (kit / "5_acceptance.md").read_text()
    )
    moves = msgspec.structs.replace(profile, urdf=SHIPPED.description.read_text())
    (gap,) = [each for each in examine(moves) if each.level is not Level.FINE]
    assert "table_joint: the URDF moves" in gap.what and 'type="fixed"' in gap.advice
