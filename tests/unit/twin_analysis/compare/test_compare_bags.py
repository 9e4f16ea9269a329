"""Comparisons from bags: of this cell, of other people's robots, incomplete and damaged ones."""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import partial
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cell_recorder.reading.bag_reader_io import BagError
from harness.imitated_run import Pair, imitate
from harness.workspace import ROOT
from rich.console import Console
from scara_config import files_in_force
from twin_analysis.compare.compare_node import print_comparison
from twin_analysis.compare.track_reader_io import Opened, Topics, find_mechanism, read_bag
from twin_analysis.compare.writer_io import WrittenComparison, remarks_of, write_comparison
from twin_experiments.report.record import RecordError

CONFIG = ROOT / "config"
MakeBag = Callable[..., Path]
TIMES = np.arange(0.0, 4.0, 0.01)


def compare(*bags: Path, topics: Topics | None = None) -> WrittenComparison:
    """Compare bags into a folder beside the first."""
    return write_comparison(bags, bags[0].parent / "out", topics or Topics(), CONFIG)


def swing(late: float = 0.0) -> tuple[Any, Any]:
    """Return positions and velocities of two joints that swing once."""
    u = np.clip(TIMES - 1.0 - late, 0.0, 2.0) / 2.0
    rise = np.sin(np.pi * u) ** 2
    slope = np.where((u > 0.0) & (u < 1.0), np.pi * np.sin(2.0 * np.pi * u) / 2.0, 0.0)
    return np.stack((rise, -0.5 * rise), axis=1), np.stack((slope, -0.5 * slope), axis=1)


Foreign = Callable[..., Path]
TOPICS = Topics("arm/joint_states", "sim/joint_states")


@pytest.fixture
def without_figures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Draw nothing, which takes most of the time: for tests of what a comparison says."""
    monkeypatch.setattr("twin_analysis.compare.writer_io.write_figures", lambda *_: {})


@pytest.fixture
def foreign(bag_maker: Any) -> Foreign:
    """Return what writes a bag of a robot that is not ours.

    Two topics of joint states and nothing else.
    """
    return partial(write_foreign, bag_maker)


def write_foreign(
    bag_maker: Any,
    folder: Path,
    names: tuple[str, str] = ("shoulder", "wrist"),
    velocities: bool = True,
    stamps: bool = True,
) -> Path:
    """Write a bag of a robot that is not ours."""
    maker = bag_maker()
    for topic, late in (("arm/joint_states", 0.0), ("sim/joint_states", 0.02)):
        positions, speeds = swing(late)
        maker.joint_states(topic, names, TIMES, positions, speeds)
    if not velocities or not stamps:
        zero = maker.store.types["builtin_interfaces/msg/Time"](0, 0)
        for sample in maker.samples:
            if not velocities:
                sample.message.__dict__["velocity"] = np.zeros(0)
            if not stamps:
                sample.message.header.__dict__["stamp"] = zero
    maker.text(0.0, "notes", "a robot")
    return maker.write(folder / "foreign.bag")


def write_marked(maker: Any, path: Path, *markers: tuple[float, str], until: float = 4.0) -> Path:
    """Write a bag of a robot that is not ours, with marks; its twin ends at ``until`` [s]."""
    for topic, late, end in (("arm/joint_states", 0.0, 4.0), ("sim/joint_states", 0.02, until)):
        count = round(100.0 * end)
        rows = [each[:count] for each in (TIMES, *swing(late))]
        maker.joint_states(topic, ("shoulder", "wrist"), *rows)
    for at, text in markers:
        maker.marker(at, text)
    return maker.write(path)


def test_a_run_is_compared_experiment_by_experiment(make_bag: MakeBag) -> None:
    """Table and figures are written; lag and fidelity are those of the imitated follower."""
    bag = make_bag(lag_s=0.004)
    written = compare(bag)
    document = json.loads((written.folder / "comparison.json").read_text())
    assert [e["name"] for e in document["experiments"]] == ["real_leads", "twin_leads"]
    for experiment in document["experiments"]:
        (pair,) = experiment["real_twin"]
        assert pair["lag_s"] == pytest.approx(0.004, abs=2e-4)
        assert pair["fidelity"]["matched_percent"] > 98.0 and experiment["reasons"] == []
        assert pair["leader"] == ("real" if experiment["name"] == "real_leads" else "twin")
    pictures = sorted(file.name for file in written.folder.glob("*.png"))
    assert pictures == sorted(
        f"{name}_{kind}.png"
        for name in ("real_leads", "twin_leads")
        for kind in ("paths", "joints", "distance", "along_path")
    )
    assert "Munoz" in (written.folder / "comparison.html").read_text()


@pytest.mark.usefixtures("without_figures")
def test_who_led_a_recording_that_begins_in_motion_is_what_the_controller_said(
    bag_maker: Any, tmp_path: Path
) -> None:
    """Both sides move from their first samples to the last: who began is not in them."""
    maker = bag_maker()
    imitate(maker, Pair(without=("experiment/marker",)), ("twin_leads",))
    maker.samples = [
        each for each in maker.samples if 1.6 < each.at < 1.9 or each.topic.endswith("/decisions")
    ]
    (experiment,) = compare(maker.write(tmp_path / "run.bag")).experiments
    assert experiment.pairs[0].track.leader == "twin"


@pytest.mark.usefixtures("without_figures")
def test_at_rest_the_tools_are_held_against_each_other_alone(make_bag: MakeBag) -> None:
    """However far either is from its set position: that is the report's, and has another name."""
    written = compare(make_bag(experiments=("real_leads",), offset=(0.0, 0.0, 0.0005, 0.0)))
    document = json.loads((written.folder / "comparison.json").read_text())
    (pair,) = document["experiments"][0]["real_twin"]
    assert "positioning_error_max_mm" not in pair
    assert pair["rest_apart_max_mm"] == pytest.approx(0.5, abs=0.01)


@pytest.mark.thorough
@pytest.mark.usefixtures("without_figures")
def test_recordings_are_held_against_the_first(make_bag: MakeBag) -> None:
    """A repeat whose twin is 0.5 mm higher is off by that.

    Bags of one name get different labels.
    """
    first, other = (
        make_bag(experiments=("real_leads",), offset=(0.0, 0.0, up, 0.0)) for up in (0.0, 0.0005)
    )
    written = compare(first, other)
    assert len(written.labels) == 2
    (experiment,) = written.experiments
    runs = {run.side: run for run in experiment.runs}
    assert runs["real"].path_max < 0.1
    assert runs["twin"].time_rms == pytest.approx(0.5, abs=0.02)
    assert 0.3 < runs["twin"].path_max <= 0.52, "where the way leads up, the lifted path is nearer"


def test_bags_of_other_people_are_compared_by_their_joint_states(
    foreign: Foreign, tmp_path: Path
) -> None:
    """Unknown joints, no markers, no configuration: joints in SI over the whole recording.

    Who moved first led.
    """
    written = compare(foreign(tmp_path), topics=TOPICS)
    (experiment,) = written.experiments
    (pair,) = experiment.pairs
    assert (experiment.name, pair.track.leader, written.mechanism.names) == (
        "recording",
        "real",
        ("shoulder", "wrist"),
    )
    assert pair.lag_s == pytest.approx(0.02, abs=1e-3)
    assert pair.comparison is None and {joint.unit for joint in pair.joints} == {"rad or m"}


@pytest.mark.usefixtures("without_figures")
@pytest.mark.parametrize(
    ("options", "remark"),
    [
        ({"velocities": False}, "no velocities, positions are differentiated"),
        ({"stamps": False}, "no stamps, times of receipt"),
    ],
)
def test_what_is_missing_in_joint_states_is_made_up_for_and_said(
    foreign: Foreign, tmp_path: Path, options: dict[str, bool], remark: str
) -> None:
    """The lag is still found."""
    written = compare(foreign(tmp_path, **options), topics=TOPICS)
    assert any(remark in text for text in written.remarks)
    assert written.experiments[0].pairs[0].lag_s == pytest.approx(0.02, abs=2e-3)


@pytest.mark.usefixtures("without_figures")
def test_some_of_our_joints_are_compared_in_their_units(foreign: Foreign, tmp_path: Path) -> None:
    """joint_1 and joint_2 alone do not place the tool, but have degrees."""
    written = compare(foreign(tmp_path, names=("joint_1", "joint_2")), topics=TOPICS)
    assert written.mechanism.tool is None
    assert [joint.unit for joint in written.experiments[0].pairs[0].joints] == ["deg", "deg"]


@pytest.mark.usefixtures("without_figures")
def test_a_joint_that_ours_lacks_makes_it_another_robot(foreign: Foreign, tmp_path: Path) -> None:
    """Its joint_1 may be anything: no joint is left out, and none is read in our units."""
    written = compare(foreign(tmp_path, names=("joint_1", "joint_5")), topics=TOPICS)
    (pair,) = written.experiments[0].pairs
    assert [(joint.name, joint.unit) for joint in pair.joints] == [
        ("joint_1", "rad or m"),
        ("joint_5", "rad or m"),
    ]


@pytest.mark.parametrize(
    ("topics", "text"),
    [
        (
            Topics(),
            r"no message of real/joint_states \(--real-topic\); .*/arm/joint_states, "
            r"/sim/joint_states",
        ),
        (
            Topics("arm/joint_states"),
            r"no message of twin/joint_states \(--twin-topic\); .*/arm/joint_states",
        ),
        (
            Topics("notes", "sim/joint_states"),
            r"notes \(--real-topic\) is std_msgs/msg/String; .*/arm/joint_states",
        ),
    ],
)
def test_missing_and_wrong_topics_are_named_with_what_the_bag_has(
    foreign: Foreign, tmp_path: Path, topics: Topics, text: str
) -> None:
    """A user sees which option to set and to what."""
    with pytest.raises(BagError, match=text):
        compare(foreign(tmp_path), topics=topics)


@pytest.mark.usefixtures("without_figures")
def test_an_experiment_that_was_not_recorded_takes_no_other_with_it(
    bag_maker: Any, tmp_path: Path
) -> None:
    """The recorder was ended as it began; all that was recorded is compared."""
    marks = ((0.5, "start one"), (3.0, "end one"), (3.995, "start two"))
    written = compare(write_marked(bag_maker(), tmp_path / "run.bag", *marks), topics=TOPICS)
    one, two = written.experiments
    assert (one.name, len(one.pairs), one.reasons) == ("one", 1, ())
    assert (two.name, two.pairs) == ("two", ()) and "samples between 3.9" in two.reasons[0]


@pytest.mark.usefixtures("without_figures")
def test_where_an_experiment_begins_and_ends_is_read_from_its_marks(
    bag_maker: Any, tmp_path: Path
) -> None:
    """What the recording lacks of it is told: here the end, and the twin behind 2 s."""
    bag = write_marked(bag_maker(), tmp_path / "run.bag", (0.5, "start one"), until=2.0)
    (experiment,) = compare(bag, topics=TOPICS).experiments
    early, holes = experiment.reasons
    assert early.endswith(": the recording ends before the experiment does")
    assert ": 57." in holes and "of the time has no samples" in holes


@pytest.mark.usefixtures("without_figures")
def test_what_the_others_are_held_against_is_named(bag_maker: Any, tmp_path: Path) -> None:
    """The first recording that has the experiment; that the very first lacks it is a reason."""
    bags = [
        write_marked(
            bag_maker(), tmp_path / f"{label}.bag", (0.5, f"start {name}"), (3.5, f"end {name}")
        )
        for label, name in (("a", "one"), ("b", "two"), ("c", "two"))
    ]
    written, said = compare(*bags, topics=TOPICS), StringIO()
    one, two = written.experiments
    assert (one.first, one.runs, one.reasons) == ("a", (), ())
    assert two.reasons == ("a has no two: nothing is held against it",)
    document = json.loads((written.folder / "comparison.json").read_text())
    assert [experiment["first"] for experiment in document["experiments"]] == ["a", "b"]
    assert "Against b (2)" in (written.folder / "comparison.html").read_text()
    print_comparison(written, Console(file=said, width=200))
    assert "two: against b" in said.getvalue()


def test_bags_without_a_common_joint_cannot_be_compared(foreign: Foreign, tmp_path: Path) -> None:
    """What each has is named."""
    (tmp_path / "b").mkdir()
    one, other = foreign(tmp_path), foreign(tmp_path / "b", names=("left", "right"))
    with pytest.raises(
        RecordError, match=r"no joint is in all of them: .*shoulder, wrist.*left, right"
    ):
        compare(one, other, topics=TOPICS)


def recorded_files(**changed: str) -> str:
    """Return what the twin controller says of the chosen robot's files, some of them changed."""
    files = {name: path.read_text() for name, path in files_in_force(CONFIG).items()}
    return json.dumps({**files, **changed})


def opened(make_bag: MakeBag, label: str, files: str | None = None) -> Opened:
    """Read a bag that holds these files, or none."""
    bag = make_bag(experiments=("real_leads",), configuration=files)
    return read_bag(bag, label, Topics(), CONFIG)


def test_recordings_of_different_robots_are_refused(
    make_bag: MakeBag, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The same name slides in one and turns in the other; both are named."""
    here, mine = opened(make_bag, "here"), opened(make_bag, "a", recorded_files())
    monkeypatch.setenv("SCARA_ROBOT", "articulated_six")
    other = opened(make_bag, "b", recorded_files())
    text = r"b was recorded of articulated_six \(sliding: none\), a of fanuc_sr6ia "
    text += r"\(sliding: joint_3\): only recordings of one robot"
    with pytest.raises(RecordError, match=text):
        find_mechanism([mine, other])
    with pytest.raises(RecordError, match=r"here of fanuc_sr6ia .*, by this machine's profile: "):
        find_mechanism([here, other])
    # Nobody knows of which robot a bag without a profile is.
    assert find_mechanism([mine, here]).names == find_mechanism([mine]).names


def test_other_lengths_of_the_same_robot_are_told(make_bag: MakeBag) -> None:
    """Its places are those of the first recording's arm."""
    text = (CONFIG / "robots" / "fanuc_sr6ia" / "robot.yaml").read_text()
    longer = recorded_files(**{"robot.yaml": text.replace("l1_mm: 350.0", "l1_mm: 350.5")})
    both = [opened(make_bag, "a", recorded_files()), opened(make_bag, "b", longer)]
    assert find_mechanism(both).tool is not None
    told = [remark for remark in remarks_of(both) if "lengths" in remark]
    assert told == ["b: recorded with other lengths of the arm than those of a, which count here"]


@pytest.mark.usefixtures("without_figures")
def test_an_unfinished_bag_is_compared_from_a_repaired_copy(
    make_bag: MakeBag, tmp_path: Path
) -> None:
    """A recording that broke off gives what it has, and the page says so."""
    whole = make_bag(experiments=("real_leads",)).read_bytes()
    cut = tmp_path / "cut.bag"
    cut.write_bytes(whole[: int(len(whole) * 0.6)])
    (tmp_path / "cut.part0003.bag").write_bytes(b"")
    written = compare(cut)
    gone = "cut: The recording is damaged. Not read: cut.part0002.bag: there is no such part;"
    assert any(remark.startswith(gone) for remark in written.remarks)
    assert any("a repaired copy was read" in remark for remark in written.remarks)
    assert written.experiments[0].pairs[0].fidelity.matched_percent > 98.0
