"""A whole report from bags that imitate a run, held against closed forms."""

from __future__ import annotations

import hashlib
import io
import json
import re
from collections.abc import Callable
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cell_recorder.reading.bag_reader_io import BagError
from operator_panel.retelling.run_folders_io import list_runs
from rich.console import Console
from scara_config import ConfigError
from twin_experiments.report.document import report_document
from twin_experiments.report.record import RecordError
from twin_experiments.report.report_io import Report, analyse_bag, write_report
from twin_experiments.run.terminal_node import print_report

CONFIG = Path(__file__).resolve().parents[3] / "config"
MakeBag = Callable[..., Path]
DESIGNED = {
    "name",
    "leader",
    "samples",
    "duration_s",
    "lag_s",
    "path_error_max_mm",
    "path_error_max_percent",
    "path_error_rms_percent",
    "positioning_error_max_mm",
    "positioning_error_max_percent",
    "verdict",
}


def analyse(bag: Path) -> dict[str, Any]:
    """Return what report.json would hold."""
    _, chosen, results = analyse_bag(bag, CONFIG)
    return report_document(results, chosen.robot.reach_mm, chosen.experiments.paper)


def page_of(written: Report) -> str:
    """Return the page as it is read: a space that keeps a unit beside its number is a space."""
    return (written.folder / "report.html").read_text().replace("\u00a0", " ")


@pytest.fixture
def without_figures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Draw nothing, which takes most of the time: for tests of what a report says."""
    monkeypatch.setattr("twin_experiments.report.report_io.write_figures", lambda *_: {})


@pytest.fixture(scope="module")
def written(make_bag: MakeBag) -> Report:
    """Write the report of an imitated run once."""
    bag = make_bag()
    return write_report(bag, bag.parent / "out", CONFIG)


def test_report_json_is_as_designed(written: Report) -> None:
    """The keys that others read are there, for both experiments, beside the article's figures."""
    document = json.loads((written.folder / "report.json").read_text())
    assert written.passed
    assert document["paper"] == {"path_error_percent": 5.0, "positioning_error_percent": 2.0}
    assert list(document) == ["experiments", "paper", "made_with"]
    assert [(e["name"], e["leader"], e["verdict"]) for e in document["experiments"]] == [
        ("real_leads", "real", "pass"),
        ("twin_leads", "twin", "pass"),
    ]
    for experiment in document["experiments"]:
        assert set(experiment) >= DESIGNED
        assert experiment["held"] == ["P1", "P2", "P3", "P1", "P2", "P3", "P1"]


@pytest.mark.usefixtures("without_figures")
def test_a_report_says_what_its_figures_were_made_with(
    make_bag: MakeBag, recorded_configuration: str, fastest_joint_percent: float
) -> None:
    """Robot, plant, speed, configuration and time come from the bag, the rest from this machine."""
    plant = {"name": "soft", "description": "as <soft> as can be", "payload_kg": 1.5}
    bag = make_bag(plant=json.dumps(plant), configuration=recorded_configuration)
    made_with = (written := write_report(bag, bag.parent / "out", CONFIG)).made_with.document()
    document = json.loads((written.folder / "report.json").read_text())
    assert document["made_with"] == made_with
    assert (made_with["robot"], made_with["plant"]) == ("fanuc_sr6ia", plant)
    assert made_with["speed_percent"] == pytest.approx(
        {"real_leads": fastest_joint_percent, "twin_leads": fastest_joint_percent}, abs=0.1
    )
    digest = hashlib.sha256(recorded_configuration.encode()).hexdigest()[:12]
    assert made_with["configuration"] == digest
    assert made_with["date"] == "2030-03-17T17:46:40+00:00"
    page = (written.folder / "report.html").read_text()
    for text in ("soft: as &lt;soft&gt; as can be; payload 1.5 kg", digest, made_with["commit"]):
        assert text in page


def test_one_sentence_stands_above_everything(
    make_bag: MakeBag, written: Report, without_figures: None
) -> None:
    """It is the first that a reader reads, and it says which limit was missed first."""
    page = page_of(written)
    first = re.search(r"<p class=\"verdict pass\">([^<]*)", page)
    assert first and first[1].startswith("Good: real robot and twin moved as one in both")
    assert page.index("verdict pass") < page.index("real_leads is good")
    bag = make_bag(lag_s=0.1)
    bad = page_of(write_report(bag, bag.parent / "out", CONFIG))
    told = re.search(r"<p class=\"verdict FAIL\">([^<]*)", bad)
    assert told and "2 of 2 experiments missed what is asked, first real_leads: the" in told[1]


@pytest.mark.parametrize("finished", [True, False])
@pytest.mark.usefixtures("without_figures")
def test_what_is_missing_of_a_damaged_bag_is_said_wherever_its_report_is_seen(
    make_bag: MakeBag, finished: bool
) -> None:
    """On the page below the verdict, on the terminal, and in the list of runs: one line."""
    bag = make_bag()
    data = bytearray(bag.read_bytes())
    messages = [at for at in range(len(data)) if data[at : at + 4] == b"op=\x02"]
    middle = messages[len(messages) // 2]
    data[middle - 4 : middle + 2] = bytes(6)
    bag.write_bytes(data if finished else data[:-100])
    written = write_report(bag, bag.parent, CONFIG)
    named = r"1 message of the chunk at byte \d+" if finished else r"\d+ bytes from byte \d+ on"
    line = re.search(r'<p class="sentence FAIL">(The recording is damaged[^<]*)', page_of(written))
    assert line and re.match(rf"The recording is damaged\. Not read: (run\.bag: )?{named}", line[1])
    console = Console(file=io.StringIO(), width=200)
    print_report(written, console)
    assert line[1] in console.file.getvalue()
    (listed,) = [run for run in list_runs(bag.parent.parent) if run.name == bag.parent.name]
    assert listed.missing == line[1]


@pytest.mark.usefixtures("without_figures")
def test_a_needle_is_told_with_its_time_and_its_cause(make_bag: MakeBag) -> None:
    """The follower jumps by 3 mm for 20 ms in a move and comes back; nothing else happens."""
    bag = make_bag(lag_s=0.0, kick=(1.1, 1.12, 0.003))
    written = write_report(bag, bag.parent / "out", CONFIG)
    document = json.loads((written.folder / "report.json").read_text())
    for experiment in document["experiments"]:
        (needle,) = experiment["needles"]
        assert needle["at_s"] == pytest.approx(1.11, abs=0.02)
        assert needle["height_mm"] == pytest.approx(3.0, abs=0.2)
        assert needle["timing_ms"] == pytest.approx(
            needle["height_mm"] / needle["tool_speed_m_s"], rel=1e-3
        )
        assert needle["cause"] == "none"
    assert "1 needle (peaks of the distance shorter than 60 ms, violet bands)" in page_of(written)


def test_the_page_begins_with_a_sentence_for_each_experiment(written: Report) -> None:
    """Good or bad comes before all figures, and the label right after it."""
    page = (written.folder / "report.html").read_text()
    order = [
        page.index(text)
        for text in (
            "real_leads is good: while moving",
            "twin_leads is good: while moving",
            "<th>plant</th><td>not recorded</td>",
            "reach 650 mm, recorded",
            "path error max",
        )
    ]
    assert order == sorted(order)


@pytest.mark.parametrize(
    ("text", "error"),
    [
        ("{", "real/plant: Input data was truncated"),
        ('{"name": "soft", "payload_kg": 1}', "real/plant: .* required field `description`"),
        (
            '{"name": "soft", "description": "", "payload_kg": "1"}',
            r"real/plant: Expected `float`, got `str` - at `\$.payload_kg`",
        ),
    ],
)
def test_a_plant_that_is_not_understood_is_named(make_bag: MakeBag, text: str, error: str) -> None:
    """A figure without its label is no figure."""
    with pytest.raises(BagError, match=f"run.bag: {error}"):
        analyse(make_bag(plant=text))


@pytest.mark.usefixtures("without_figures")
def test_the_terminal_names_plant_and_speed(
    make_bag: MakeBag, fastest_joint_percent: float
) -> None:
    """A table that is copied from there keeps its label."""
    plant = {"name": "soft", "description": "a [soft] robot", "payload_kg": 1.5}
    for options, words in (({"plant": json.dumps(plant)}, "soft: a [soft] robot"), ({}, "not")):
        bag = make_bag(**options)
        console = Console(record=True, width=120, file=io.StringIO())
        print_report(write_report(bag, bag.parent / "out", CONFIG), console)
        printed = console.export_text()
        assert f"plant {words}" in printed
        (speed,) = [line for line in printed.splitlines() if "speed" in line]
        assert speed.count(f"{fastest_joint_percent:.0f} %") == 2


@pytest.mark.usefixtures("without_figures")
def test_a_pause_of_the_machine_is_told_and_its_error_is_given_apart(make_bag: MakeBag) -> None:
    """The last message comes 0.997 s, the next one 1.041 s after the start of each experiment.

    The follower is 6.5 mm too high in the pause and 0.1 s after it: 1 % of 650 mm.
    """
    bag = make_bag(lag_s=0.0, pause=(1.0, 1.04), kick=(1.0, 1.14, 0.0065))
    written = write_report(bag, bag.parent / "out", CONFIG)
    document = json.loads((written.folder / "report.json").read_text())
    for experiment in document["experiments"]:
        assert experiment["pauses"] == 1
        assert experiment["longest_pause_ms"] == pytest.approx(44.0, abs=0.01)
        assert experiment["path_error_max_percent"] == pytest.approx(1.0, abs=0.01)
        assert experiment["path_error_max_undisturbed_percent"] < 0.01
    page = page_of(written)
    assert "1 pause of the machine, or of the recorder; the longest took 44 ms." in page
    assert "without the pauses and the 0.2 s after each: 0.00" in page
    console = Console(record=True, width=120, file=io.StringIO())
    print_report(written, console)
    assert "real_leads: 1 pause of the machine, or of the recorder" in console.export_text()


def test_a_pause_is_a_grey_band_in_the_figure_of_errors(make_bag: MakeBag, written: Report) -> None:
    """One in each of its two plots, and none without a pause."""
    from matplotlib.image import imread

    def grey(report: Report) -> int:
        image = imread(report.folder / "real_leads_errors.png")[..., :3]
        band = np.abs(image - np.array([0x9C, 0xA3, 0xAF]) / 255.0).max(axis=2) < 0.01
        columns = band.sum(axis=0)
        return int((columns > 300).sum())

    bag = make_bag(pause=(1.0, 1.04))
    assert grey(write_report(bag, bag.parent / "out", CONFIG)) >= 1 + grey(written)


def test_a_run_without_pauses_says_so(written: Report) -> None:
    """The quiet between two experiments belongs to neither."""
    document = json.loads((written.folder / "report.json").read_text())
    for experiment in document["experiments"]:
        assert (experiment["pauses"], experiment["longest_pause_ms"]) == (0, 0.0)
        undisturbed = experiment["path_error_max_undisturbed_percent"]
        assert undisturbed == experiment["path_error_max_percent"]
    page = page_of(written)
    assert "there was never more than 30 ms without any message" in page


@pytest.mark.usefixtures("without_figures")
def test_positions_at_rest_are_held_against_the_true_geometry_too(make_bag: MakeBag) -> None:
    """A tool that is 0.13 mm too high: 0.02 % of 650 mm; the error as defined does not see it.

    0.03 mm of the sliding joint are its zero offset, by which it stands higher than the twin.
    """
    home = [[0, -1, 0, 0.65], [-1, 0, 0, 0], [0, 0, -1, 0.16013], [0, 0, 0, 1]]
    plant = {
        "name": "made",
        "description": "as it was made",
        "payload_kg": 0.0,
        "geometry": {"screw_axes": {}, "home_pose": home},
        "axes": {"joint_3": {"zero_offset_mm": 0.03}},
    }
    bag = make_bag(lag_s=0.0, offset=(0.0, 0.0, 0.00003, 0.0), plant=json.dumps(plant))
    written = write_report(bag, bag.parent / "out", CONFIG)
    document = json.loads((written.folder / "report.json").read_text())
    second = document["experiments"][1]
    assert second["positioning_error_max_mm"] == pytest.approx(0.03, abs=1e-3)
    assert second["true_positioning_error_max_mm"] == pytest.approx(0.16, abs=1e-3)
    assert second["true_positioning_error_max_percent"] == pytest.approx(0.0246, abs=2e-4)
    assert second["calibrated_positioning_error_max_mm"] == pytest.approx(0.0, abs=1e-3)
    assert (
        "At rest, against the robot&#39;s true geometry: max 0.160 mm, 0.025 % of reach. "
        "Calibration of lengths and zero offsets would remove 0.160 mm of it and leave 0.000 mm."
    ) in page_of(written)


def test_without_a_true_geometry_its_figures_are_null(written: Report) -> None:
    """Nobody knows how a robot was made unless it is said."""
    document = json.loads((written.folder / "report.json").read_text())
    for experiment in document["experiments"]:
        assert experiment["true_positioning_error_max_mm"] is None
        assert experiment["true_positioning_error_max_percent"] is None
        assert experiment["calibrated_positioning_error_max_mm"] is None
    assert "true geometry: not known." in (written.folder / "report.html").read_text()


@pytest.mark.parametrize("lag_s", [0.0, 0.007, 0.03])
def test_the_lag_of_the_follower_is_found_whoever_leads(make_bag: MakeBag, lag_s: float) -> None:
    """Sub-millisecond, with sides sampled at 250 and 200 Hz and a micrometre of noise."""
    document = analyse(make_bag(lag_s=lag_s, noise=1e-6))
    assert [e["lag_s"] for e in document["experiments"]] == pytest.approx([lag_s, lag_s], abs=2e-4)


def test_the_path_error_is_lag_times_speed_and_vanishes_without_the_lag(
    make_bag: MakeBag, largest_tool_speed: float
) -> None:
    """For a short lag the largest distance is the largest tool speed times the lag."""
    document = analyse(make_bag(lag_s=0.001))
    first = document["experiments"][0]
    assert first["path_error_max_mm"] == pytest.approx(1e3 * largest_tool_speed * 0.001, rel=1e-2)
    assert first["path_error_max_after_lag_mm"] < 0.01


def test_an_offset_of_the_follower_is_its_positioning_error(make_bag: MakeBag) -> None:
    """0.5 mm up at the follower are 0.5 mm between the sides and against the set position.

    The leader has 0.
    """
    document = analyse(make_bag(offset=(0.0, 0.0, 0.0005, 0.0)))
    first = document["experiments"][0]
    assert first["positioning_error_max_mm"] == pytest.approx(0.5, abs=1e-3)
    assert first["positioning_error_max_percent"] == pytest.approx(100.0 * 0.5 / 650.0, abs=1e-3)
    for rest in first["positions"]:
        assert rest["real_set_mm"] < 0.01 < rest["twin_set_mm"]


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        ({"lag_s": 0.1}, r"path error \d+\.\d+ % of reach, limit 2 %"),
        ({"offset": (0.0, 0.0, 0.002, 0.0)}, r"positioning error 0.308 % of reach, limit 0.2 %"),
        ({"offset": (0.0, 0.0, -0.05, 0.0)}, r"positioning error 7.692 % of reach"),
        (
            {"hole": ("twin/joint_states", 1.0, 1.5)},
            r"5\.\d % of the time has no samples, limit 1 %",
        ),
        ({"frozen_after": 3.0}, r"both stood still at P1 P2 P3, expected P1 P2 P3 P1 P2 P3 P1"),
    ],
)
def test_a_limit_that_is_missed_is_the_reason_to_fail(
    make_bag: MakeBag, options: dict[str, Any], reason: str
) -> None:
    """The verdict says by how much."""
    document = analyse(make_bag(**options))
    for experiment in document["experiments"]:
        assert experiment["verdict"] == "fail"
        assert any(re.search(reason, text) for text in experiment["reasons"])


def test_the_age_of_samples_is_receipt_minus_the_time_they_were_due(make_bag: MakeBag) -> None:
    """Set points due 10 ms after their stamp and received 12 ms after it are 2 ms old."""
    document = analyse(make_bag())
    age = document["experiments"][0]["sample_age_ms"]["joint_pose_controller/follow"]
    assert age == pytest.approx({"median": 2.0, "p95": 2.0, "max": 2.0}, abs=1e-3)


@pytest.mark.usefixtures("without_figures")
def test_the_configuration_in_the_bag_is_used(
    make_bag: MakeBag, recorded_configuration: str
) -> None:
    """A report of an old bag is judged by the limits of its day."""
    files = json.loads(recorded_configuration)
    files["experiments.yaml"] = files["experiments.yaml"].replace(
        "path_error_percent: 2.0", "path_error_percent: 0.01"
    )
    bag = make_bag(configuration=json.dumps(files))
    report = write_report(bag, bag.parent, CONFIG)
    assert report.configuration.origin == "in the bag"
    assert "limit 0.01 %" in report.results[0].reasons[0]
    page = (report.folder / "report.html").read_text()
    assert "modbus_map.yaml" in page and "Analysed with the configuration in the bag." in page


def test_a_wrong_configuration_in_the_bag_is_named(
    make_bag: MakeBag, recorded_configuration: str
) -> None:
    """It is no excuse to take another one."""
    files = json.loads(recorded_configuration)
    files["robot.yaml"] = files["robot.yaml"].replace("reach_mm: 650.0", "reach_mm: -1.0")
    with pytest.raises(ConfigError, match=r"robot.yaml in the bag: reach_mm = -1.0"):
        analyse(make_bag(configuration=json.dumps(files)))
    with pytest.raises(BagError, match="configuration is no JSON"):
        analyse(make_bag(configuration="{"))
    with pytest.raises(ConfigError, match=r"robot.yaml in the bag: is no valid YAML"):
        analyse(make_bag(configuration=json.dumps({"robot.yaml": "a: ["})))


class _Page(HTMLParser):
    """Collects what a page asks for, and its images."""

    def __init__(self) -> None:
        super().__init__()
        self.images: list[str] = []
        self.asked: list[str] = []
        self.places: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        for name, value in attrs:
            if name == "id":
                self.places.append(value or "")
            if name in ("src", "href", "data"):
                (
                    self.images
                    if (value or "").startswith("data:image/png;base64,")
                    else self.asked
                ).append(value or "")


def test_the_page_is_self_contained_and_escapes_what_nodes_said(written: Report) -> None:
    """Ten embedded figures, no request, text of a node stays text."""
    whole = (written.folder / "report.html").read_text()
    page = _Page()
    page.feed(whole)
    assert len(page.images) == 10
    assert all(asked.startswith("#") for asked in page.asked), "only places of the page itself"
    assert {asked[1:] for asked in page.asked} <= set(page.places)
    text = re.sub(r"<script.*?</script>", "", whole, flags=re.DOTALL)
    assert "url(" not in text and "@import" not in text
    assert "late &lt;&amp;&gt;" in text and "late <&>" not in text
    assert text.count("WARN: late") == 1, "a warning that stays is listed once"
    for word in ("the real robot moved first", "article", "Versions", "prefers-color-scheme: dark"):
        assert word in text


def test_the_figures_are_images_of_a_readable_size(written: Report) -> None:
    """Blue and orange lines are on the figure of the worst place, and a path has many colours."""
    from matplotlib.image import imread

    paths = imread(written.folder / "real_leads_paths.png")[..., :3]
    assert paths.shape[1] > 1000 and len(np.unique(paths.reshape(-1, 3), axis=0)) > 500
    image = imread(written.folder / "real_leads_worst.png")[..., :3]
    for red, green, blue in ((0x16, 0x67, 0xC2), (0xFF, 0x9A, 0x1F)):
        assert (np.abs(image - np.array([red, green, blue]) / 255.0).max(axis=2) < 0.02).sum() > 200


def test_the_limit_stands_beside_the_error(make_bag: MakeBag, written: Report) -> None:
    """In words always, and as a line where the error comes near it."""
    assert "over time; allowed are 13.0 mm, 2 % of reach" in page_of(written)
    assert '"limit"' not in page_of(written)
    bag = make_bag(lag_s=0.03)
    assert '"limit":13.0' in page_of(write_report(bag, bag.parent / "out", CONFIG))


def test_the_difference_of_each_joint_has_a_figure_of_its_own(make_bag: MakeBag) -> None:
    """On a scale that shows it: a lag of 4 ms is some tenths of a degree, up and down."""
    bag = make_bag(lag_s=0.004)
    page = page_of(write_report(bag, bag.parent / "out", CONFIG))
    told = [json.loads(text) for text in re.findall(r'json">({.*?})</script>', page)]
    (joints, _) = (one for one in told if one["panels"][0]["series"][0]["name"] == "real - twin")
    assert [panel["y"] for panel in joints["panels"]] == [
        "joint_1 [deg]",
        "joint_2 [deg]",
        "joint_3 [mm]",
    ]
    values = [value for _, value in joints["panels"][0]["series"][0]["data"]]
    assert -2.0 < min(values) < -0.1 and 0.1 < max(values) < 2.0


def test_an_experiment_that_was_not_finished_fails_but_is_reported(make_bag: MakeBag) -> None:
    """A crash in the middle costs the verdict, not the figures."""
    path = make_bag()
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 3])
    report = write_report(path, path.parent, CONFIG)
    assert "the recording ends before the experiment does" in report.results[0].reasons
    comparison = report.results[0].comparison
    assert comparison is not None and comparison.path.max_mm > 0.0
    assert "a repaired copy was read" in (report.folder / "report.html").read_text()


def test_a_side_without_samples_fails_the_experiment_with_its_name(make_bag: MakeBag) -> None:
    """The others are reported all the same."""
    document = analyse(make_bag(silent=("twin/joint_states", "twin_leads")))
    first, second = document["experiments"]
    assert first["verdict"] == "pass"
    assert (second["verdict"], second["samples"], second["lag_s"]) == ("fail", 0, None)
    assert "twin: " in second["reasons"][0] and "samples between" in second["reasons"][0]


@pytest.mark.parametrize("topic", ["real/ground_truth", "twin/joint_states"])
def test_a_topic_that_is_missing_is_named(make_bag: MakeBag, topic: str) -> None:
    """No figure is made up."""
    with pytest.raises(BagError, match=rf"run.bag: no message of {topic}; the bag holds"):
        analyse(make_bag(without=(topic,)))


@pytest.mark.usefixtures("without_figures")
def test_a_recording_without_marks_is_one_experiment(make_bag: MakeBag) -> None:
    """Whoever moved first leads, nobody asked for positions, and the error is the same."""
    bag = make_bag(experiments=("twin_leads",), lag_s=0.004, without=("experiment/marker",))
    report = write_report(bag, bag.parent / "out", CONFIG)
    marked = analyse(make_bag(experiments=("twin_leads",), lag_s=0.004))["experiments"][0]
    document = json.loads((report.folder / "report.json").read_text())
    (found,) = document["experiments"]
    assert (found["name"], found["leader"], found["verdict"]) == ("recording", "twin", "pass")
    assert found["path_error_max_mm"] == pytest.approx(marked["path_error_max_mm"], rel=1e-3)
    assert (found["visits"], found["held"]) == ([], [])
    assert "Good: real robot and twin moved as one in the experiment" in page_of(report)


@pytest.mark.usefixtures("without_figures")
def test_a_recording_of_a_real_robot_has_its_readings_in_place_of_the_truth(
    make_bag: MakeBag,
) -> None:
    """Nobody knows the truth there; the page says which it is."""
    bag = make_bag(experiments=("real_leads",), real="real/joint_states")
    report = write_report(bag, bag.parent / "readings", CONFIG)
    assert report.passed
    assert "what the twin controller read from the robot" in page_of(report)


def test_an_experiment_that_nobody_knows_is_refused(
    make_bag: MakeBag, recorded_configuration: str
) -> None:
    """The text lists those that are known."""
    files = json.loads(recorded_configuration)
    files["experiments.yaml"] = files["experiments.yaml"].replace("  twin_leads:", "  both_lead:")
    with pytest.raises(
        RecordError,
        match=r"unknown experiment twin_leads: experiments\.yaml has real_leads, both_lead",
    ):
        analyse(make_bag(configuration=json.dumps(files)))


def test_repeated_experiments_are_reported_each_and_together(make_bag: MakeBag) -> None:
    """Own figures and rows for each repeat; mean, spread and worst of the name."""
    bag = make_bag(experiments=("real_leads",) * 3)
    written = write_report(bag, bag.parent / "out", CONFIG)
    document = json.loads((written.folder / "report.json").read_text())
    assert [e["repeat"] for e in document["experiments"]] == [1, 2, 3]
    (summary,) = document["repeats"]
    errors = [e["path_error_max_percent"] for e in document["experiments"]]
    assert summary["repeats"] == summary["passed"] == 3
    assert summary["path_error_max_percent"]["worst"] == max(errors)
    assert summary["path_error_max_percent"]["mean"] == pytest.approx(sum(errors) / 3, abs=1e-5)
    assert {file.name for file in written.folder.glob("real_leads*_paths.png")} == {
        "real_leads_paths.png",
        "real_leads_2_paths.png",
        "real_leads_3_paths.png",
    }
    assert "Repeats" in (written.folder / "report.html").read_text()
