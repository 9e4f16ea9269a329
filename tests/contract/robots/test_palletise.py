"""palletise.yaml, the URDF and the robot's program speak of the same places."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ElementTree

import msgspec
import pytest
from fanuc_emulator.drives.planner import Limits, Planner
from fanuc_emulator.tp.rehearsal import read_program
from harness.workspace import ROOT
from scara_config import ConfigError, load_robot
from scara_config.frames import load_frames
from scara_config.palletise import find_palletise, load_palletise
from scara_config.programs.files import program_files
from scara_config.programs.steps import MoveStep, PathStep
from scara_control.kinematics.scara import Scara, tool_position

CONFIG = ROOT / "config"
ROBOT = load_robot(CONFIG)
WORK = load_palletise(CONFIG)
URDF = ElementTree.parse(ROBOT.description).getroot()


def frame(link: str) -> tuple[float, float, float]:
    """Return the origin of a link at the zero pose, in base_link [mm].

    The cell's own links are not turned.
    """
    x = y = z = 0.0
    while link != "base_link":
        joint = next(
            joint
            for joint in URDF.iter("joint")
            if joint.find("child") is not None and joint.find("child").get("link") == link
        )
        dx, dy, dz = map(float, joint.find("origin").get("xyz").split())
        x, y, z, link = x + dx, y + dy, z + dz, joint.find("parent").get("link")
    return 1e3 * x, 1e3 * y, 1e3 * z


def test_places_are_those_of_the_urdf() -> None:
    """Both sides put their parts where the stands and the pallet of the drawing are."""
    table, pallet = WORK.table, WORK.pallet
    for stand, (x, y) in table.stands_mm.items():
        assert frame(stand) == pytest.approx((x, y, table.stand_top_mm), abs=1e-6)
    assert frame(table.link)[:2] == pytest.approx(table.axis_mm, abs=1e-6)
    assert frame("pallet") == pytest.approx((*pallet.middle_mm, pallet.top_mm), abs=1e-6)
    assert WORK.vehicle is not None
    told = load_frames(CONFIG).find("user", WORK.vehicle.frame)
    first_mark = (*WORK.vehicle.seen(WORK.vehicle.dock())[0], pallet.top_mm * 1e-3)
    assert told.xyz_mm == pytest.approx([1e3 * value for value in first_mark])
    assert frame("cell_plate")[2] == pytest.approx(WORK.floor_mm)


@pytest.mark.parametrize("name", ["PALLETISE", "VEHICLE"])
def test_program_goes_to_the_places_of_the_file(name: str) -> None:
    """The taught positions are the places.

    Over and at each part, above and at its place on the pallet, within 0.01 mm. VEHICLE: the other
    side of the robot, its places in the vehicle's frame as it docks exactly.
    """
    assert WORK.vehicle is not None
    work, places = WORK, WORK.pallet.places()
    if name == "VEHICLE":
        station_deg, dock = -WORK.table.station_deg, WORK.vehicle.dock()
        x, y = (1e-3 * value for value in WORK.pallet.middle_mm)
        places = [dock.at(px - x, py - y) for px, py in places]
        table = msgspec.structs.replace(WORK.table, station_deg=station_deg)
        work = msgspec.structs.replace(WORK, table=table)
    planner = Planner(ROBOT, [Limits(joint.velocity, joint.acceleration) for joint in ROBOT.joints])
    here, targets = tuple(joint.lower for joint in ROBOT.joints), []
    for step in read_program(program_files(CONFIG)[name], ROBOT, CONFIG).steps:
        if isinstance(step, MoveStep | PathStep):
            here = planner.plan(step, here).end
            targets.append(here)
    targets = targets[: 8 * len(places)]  # VEHICLE goes away from it at its end
    travel, near, wanted = WORK.task.travel_mm * 1e-3, WORK.task.near_mm * 1e-3, []
    for (_, _, angle, pick), place in zip(work.picks(), places):
        over, above = (*pick, travel, angle), (*place, travel, angle)
        wanted += [
            over,
            (*pick, WORK.pick_height + near, angle),
            (*pick, WORK.pick_height, angle),
            over,
        ]
        wanted += [
            above,
            (*place, WORK.place_height + near, angle),
            (*place, WORK.place_height, angle),
            above,
        ]
    assert len(targets) == len(wanted)
    for target, (x, y, z, angle) in zip(targets, wanted):
        assert math.dist(tool_position(Scara.from_robot(ROBOT), *target[:3]), (x, y, z)) < 1e-5
        assert target[4] == pytest.approx(angle, abs=1e-6)


def test_robot_without_the_file_has_no_parts(tmp_path) -> None:  # type: ignore[no-untyped-def]
    """Another robot's cell starts without palletise.yaml; asked for by name it is an error."""
    assert find_palletise(tmp_path) is None
    with pytest.raises(ConfigError, match=r"palletise\.yaml: cannot be read"):
        load_palletise(tmp_path)
