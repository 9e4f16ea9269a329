"""Exercise 9: a program of one's own that places parts passes; what went wrong is named."""

from __future__ import annotations

import math
import re
from pathlib import Path

import msgspec
import numpy as np
import pytest
from cell_recorder.reading.bag_reader_io import open_bag
from harness.course import JOINTS, BagMaker, Scene, exercise, robot, write_scene
from harness.workspace import ROOT
from scara_config.palletise import load_palletise
from scara_config.set_up.kit_programs import texts as kit_programs
from scara_course.evidence_io import mark_bag, read_recorded
from scara_course.recorded import SHIPPED, CourseRecording
from twin_experiments.metrics.series import Motion
from twin_experiments.palletising import Handled
from twin_experiments.report.record import Run

WORK = load_palletise(ROOT / "config" / "robots" / "fanuc_sr6ia")
LEVEL = WORK.pallet.top_mm * 1e-3 + 0.5 * WORK.parts.height
PLACES = {
    part.name: (*place, LEVEL) for part, place in zip(WORK.starts()[:3], WORK.pallet.places())
}
Places = dict[str, tuple[float, float, float]]
STILL = Motion("real", np.array([0.0, 30.0]), np.zeros((2, 4)), np.zeros((2, 4)))


def side(places: Places, *events: tuple[float, str, str, str]) -> Handled:
    """Return what a side recorded: parts placed one after the other, and more events."""
    placed = [(5.0 + k, "placed", name, "") for k, name in enumerate(places)]
    return Handled([(0.0, {}), (20.0, places)], sorted([*placed, *events]))


def recording(**changed: object) -> CourseRecording:
    """Return the model recording, with something changed."""
    handled = {"real": side(PLACES), "twin": side(PLACES)}
    handled |= changed.pop("handled", {})  # type: ignore[arg-type]
    run = Run("run.bag", 0.0, 30.0, False, JOINTS, (), STILL, STILL, handled=handled)
    held = CourseRecording(run, (), ((0.5, "MINE"), (25.0, "")), WORK)
    return msgspec.structs.replace(held, **changed)


def moved(name: str, x: float = 0.0, z: float = 0.0) -> Places:
    """Put a part elsewhere [m]."""
    place = PLACES[name]
    return {**PLACES, name: (place[0] + x, place[1], place[2] + z)}


def test_a_program_of_ones_own_passes() -> None:
    """And the verdict says how near the parts lie."""
    mark = exercise(9).check.mark(recording(), robot())
    assert mark.passed and "MINE: real: 3 parts, at most 0.00 mm off; twin: 3" in mark.reason


SWAPPED = {**PLACES, "part_1": PLACES["part_2"], "part_2": PLACES["part_1"]}


@pytest.mark.parametrize(
    ("changed", "reason"),
    [
        pytest.param({"programs": ((0.5, "PALLETISE"),)}, "PALLETISE placed", id="the shipped one"),
        pytest.param(
            {"programs": ((0.5, "MINE"), (6.5, "PALLETISE"))}, "PALLETISE placed", id="half of it"
        ),
        pytest.param({"work": None}, "holds no parts", id="a cell without parts"),
        pytest.param({"handled": {"real": Handled()}}, "placed no part", id="nothing happened"),
        pytest.param(
            {"handled": {"real": side({"part_1": PLACES["part_1"]})}},
            "real: 1 parts lie on their places, 3",
            id="one part",
        ),
        pytest.param(
            {"handled": {"real": Handled([(0.0, PLACES)], [(5.0, "placed", "part_3", "")])}},
            "real: 1 parts lie on their places, 3",
            id="two lay there before",
        ),
        pytest.param(
            {"handled": {"real": side(moved("part_2", x=0.004))}},
            r"real: part_2 lies 4\.00 mm off",
            id="beside its place",
        ),
        pytest.param(
            {"handled": {"real": side(SWAPPED)}}, r"real: part_\d lies 60\.00 mm off", id="swapped"
        ),
        pytest.param(
            {"handled": {"real": side(moved("part_3", z=0.02))}},
            "real: 2 parts lie",
            id="on another part",
        ),
        pytest.param(
            {"handled": {"twin": side(moved("part_1", x=-0.0011))}},
            r"twin: part_1 lies 1\.10 mm off",
            id="the twin's crept",
        ),
        pytest.param({"handled": {"twin": Handled()}}, "twin: 0 parts lie", id="the twin alone"),
        pytest.param(
            {"handled": {"real": side(PLACES, (9.0, "dropped", "part_2", "part_2 fell"))}},
            "real: a drop: part_2 fell",
            id="dropped",
        ),
        pytest.param(
            {"handled": {"twin": side(PLACES, (9.0, "collision", "", "nozzle on part_1, 80 N"))}},
            "twin: a collision: nozzle on part_1, 80 N",
            id="pressed",
        ),
    ],
)
def test_what_went_wrong_is_named(changed: dict[str, object], reason: str) -> None:
    """Each for its own reason."""
    mark = exercise(9).check.mark(recording(**changed), robot())
    assert not mark.passed and re.search(reason, mark.reason), mark.reason


def test_the_places_on_the_card_are_those_of_the_cell() -> None:
    """Whoever types them grips and places."""
    card, task, top = exercise(9).card, WORK.task, WORK.parts.height_mm + WORK.task.gap_mm
    for number, (_, _, angle, (x, y)) in enumerate(WORK.picks()[:3], 1):
        u, v = WORK.pallet.places()[number - 1]
        pick = f"{x * 1e3:.2f} {y * 1e3:.2f} {WORK.table.stand_top_mm + top:g}"
        put = f"{u * 1e3:g} {v * 1e3:g} {WORK.pallet.top_mm + top + task.clearance_mm:g}"
        assert f"| {number} | {pick} {math.degrees(angle):g} | {put} |" in card


def test_all_shipped_programs_are_known() -> None:
    """A new one in the robot's folder would pass as a learner's own."""
    files = (ROOT / "config" / "robots" / "fanuc_sr6ia" / "programs").glob("*.LS")
    assert {path.stem for path in files} | set(kit_programs()) == set(SHIPPED)


def test_programs_are_read_from_the_recording(tmp_path: Path) -> None:
    """From when on which one ran; a paused one does not."""

    def data(maker: BagMaker) -> None:
        for at, program, running in (
            (0.5, "MINE line 1 running", True),
            (0.7, "MINE line 2 running", True),
            (1.0, "MINE line 2 paused", False),
        ):
            empty = np.zeros(0)
            fields = ("program", 50.0, [], empty, [], True, running, program, "", "AUTO")
            kind = "scara_msgs/msg/RobotData"
            maker.add(at, "real/robot_data", kind, maker.header(at), *fields)

    path = write_scene(Scene((), (), (), 2.0), tmp_path / "run.bag", data)
    with open_bag(path) as bag:
        found = read_recorded(bag, robot())
    assert [(round(at, 1), name) for at, name in found.programs] == [(0.5, "MINE"), (1.0, "")]
    assert [found.program_at(at) for at in (0.1, 0.8, 1.5)] == ["", "MINE", ""]
    assert "holds no parts" in mark_bag(exercise(9), path, robot()).reason
