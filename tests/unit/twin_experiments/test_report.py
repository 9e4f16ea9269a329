"""A whole report from bags that imitate a run: what it says and draws."""

from __future__ import annotations

import hashlib
import io
import json
import re
from collections.abc import Callable
from html.parser import HTMLParser
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from harness.imitated_run import Pair, imitate
from operator_panel.retelling.run_folders_io import list_runs
from rich.console import Console
from twin_experiments.metrics.errors import Comparison, Trace, summarize
from twin_experiments.metrics.series import Aligned, Motion
from twin_experiments.report.charts import BANDS, RED, chart_line, report_charts
from twin_experiments.report.figures_io import draw_chart, write_figures
from twin_experiments.report.paths_figure_io import draw_paths
from twin_experiments.report.report_io import Report, analyse_bag, write_report
from twin_experiments.run.terminal_node import print_report

CONFIG = Path(__file__).resolve().parents[3] / "config"
MakeBag = Callable[..., Path]
DESIGNED = set(
    re.findall(
        r"\w+",
        "name leader samples duration_s lag_s path_error_max_mm path_error_max_percent "
        "path_error_rms_percent positioning_error_max_mm positioning_error_max_percent "
        "path_angle_max_deg rest_angle_max_deg verdict",
    )
)
VISITS = ["P1", "P2", "P3", "P1", "P2", "P3", "P1"]
FIRST = ("real_leads",)


class Written(NamedTuple):
    """A report, its report.json, and its page as it is read (no-break spaces are spaces)."""

    report: Report
    document: dict[str, Any]
    page: str

    def printed(self) -> str:
        """Return what the terminal shows."""
        console = Console(file=io.StringIO(), width=200)
        print_report(self.report, console)
        return console.file.getvalue()  # type: ignore[attr-defined]


def write(bag: Path) -> Written:
    """Write the report of a bag beside it and read it."""
    report = write_report(bag, bag.parent, CONFIG)
    document = json.loads((report.folder / "report.json").read_text())
    page = (report.folder / "report.html").read_text().replace("\u00a0", " ")
    return Written(report, document, page)


def close_to(image: Any, color: str) -> Any:
    """Return where a picture has a colour."""
    wanted = np.array([int(color[k : k + 2], 16) for k in (1, 3, 5)]) / 255.0
    return np.abs(image[..., :3] - wanted).max(axis=2) < 0.02


@pytest.fixture
def without_figures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Draw nothing, which takes most of the time: for tests of what a report says."""
    monkeypatch.setattr("twin_experiments.report.report_io.write_figures", lambda *_: {})


@pytest.fixture(scope="module")
def written(make_bag: MakeBag) -> Written:
    """Write the report of an imitated run once, with all figures."""
    return write(make_bag())


def test_report_json_is_as_designed(written: Written) -> None:
    """The keys that others read are there, for both experiments, beside the article's figures.

    Nobody knows how a robot was made unless it is said, and the quiet between two experiments is a
    pause of neither.
    """
    document = written.document
    assert written.report.passed
    assert document["paper"] == {"path_error_percent": 5.0, "positioning_error_percent": 2.0}
    assert list(document) == ["experiments", "paper", "made_with"]
    assert [(e["name"], e["leader"], e["verdict"]) for e in document["experiments"]] == [
        ("real_leads", "real", "pass"),
        ("twin_leads", "twin", "pass"),
    ]
    for experiment in document["experiments"]:
        assert set(experiment) >= DESIGNED
        assert experiment["held"] == VISITS
        assert (experiment["pauses"], experiment["longest_pause_ms"]) == (0, 0.0)
        undisturbed = experiment["path_error_max_undisturbed_percent"]
        assert undisturbed == experiment["path_error_max_percent"]
        for key in ("true_positioning_error_max_mm", "true_positioning_error_max_percent"):
            assert experiment[key] is None
        assert experiment["calibrated_positioning_error_max_mm"] is None
        # Set points due 10 ms after their stamp and received 12 ms after it are 2 ms old.
        if experiment["name"] == "real_leads":
            age = experiment["sample_age_ms"]["joint_pose_controller/follow"]
            assert age == pytest.approx({"median": 2.0, "p95": 2.0, "max": 2.0}, abs=1e-3)


def test_the_page_begins_with_sentences_before_its_figures(written: Written) -> None:
    """Good or bad comes first, of the run and of each experiment, and the label right after."""
    places = [
        written.page.index(text)
        for text in (
            '<p class="verdict pass">Good: real robot and twin moved as one in both',
            "real_leads is good: while moving",
            "twin_leads is good: while moving",
            "<th>plant</th><td>not recorded</td>",
            "reach 650 mm, recorded",
            "path error max",
            "over time; allowed are 13.0 mm, 2 % of reach",
        )
    ]
    assert places == sorted(places)
    assert "Speed is percent of the joint's largest speed" in written.page
    assert "there was never more than 30 ms without any message" in written.page
    assert "true geometry: not known." in written.page
    assert "after both stood still 0.5 s" in written.page
    assert "Predicted and measured" not in written.page, "nobody judged a motion before it began"


@pytest.mark.usefixtures("without_figures")
def test_a_bad_run_begins_with_the_limit_that_was_missed_first(make_bag: MakeBag) -> None:
    """It is the first that a reader reads."""
    told = re.search(r"<p class=\"verdict FAIL\">([^<]*)", write(make_bag(lag_s=0.1)).page)
    assert told and "2 of 2 experiments missed what is asked, first real_leads: the" in told[1]


@pytest.mark.usefixtures("without_figures")
def test_a_report_says_what_its_figures_were_made_with(
    make_bag: MakeBag, recorded_configuration: str, fastest_joint_percent: float
) -> None:
    """Robot, plant, speed, configuration and time come from the bag, the rest from this machine.

    A table that is copied from the terminal keeps its label.
    """
    plant = {"name": "soft", "description": "as [soft] as <can> be", "payload_kg": 1.5}
    bag = make_bag(plant=json.dumps(plant), configuration=recorded_configuration)
    written = write(bag)
    made_with = written.document["made_with"]
    assert made_with == written.report.made_with.document()
    assert (made_with["robot"], made_with["plant"]) == ("fanuc_sr6ia", plant)
    assert made_with["speed_percent"] == pytest.approx(
        {"real_leads": fastest_joint_percent, "twin_leads": fastest_joint_percent}, abs=0.1
    )
    digest = hashlib.sha256(recorded_configuration.encode()).hexdigest()[:12]
    assert made_with["configuration"] == digest
    assert made_with["date"] == "2030-03-17T17:46:40+00:00"
    label = "soft: as [soft] as &lt;can&gt; be; payload 1.5 kg"
    for text in (label, digest, made_with["commit"]):
        assert text in written.page
    printed = written.printed()
    assert "plant soft: as [soft] as <can> be" in printed
    (speed,) = [line for line in printed.splitlines() if "speed" in line]
    assert speed.count(f"{fastest_joint_percent:.0f} %") == 2


def test_the_terminal_says_that_no_plant_was_recorded(written: Written) -> None:
    """A figure without a label says so."""
    assert "plant not recorded" in written.printed()


@pytest.mark.parametrize("finished", [True, False])
@pytest.mark.usefixtures("without_figures")
def test_what_is_missing_of_a_damaged_bag_is_said_wherever_its_report_is_seen(
    make_bag: MakeBag, finished: bool
) -> None:
    """On the page below the verdict, on the terminal, and in the list of runs: one line."""
    bag = make_bag(experiments=FIRST)
    data = bytearray(bag.read_bytes())
    messages = [at for at in range(len(data)) if data[at : at + 4] == b"op=\x02"]
    middle = messages[len(messages) // 2]
    data[middle - 4 : middle + 2] = bytes(6)
    bag.write_bytes(data if finished else data[:-100])
    written = write(bag)
    named = r"1 message of the chunk at byte \d+" if finished else r"\d+ bytes from byte \d+ on"
    line = re.search(r'<p class="sentence FAIL">(The recording is damaged[^<]*)', written.page)
    assert line and re.match(rf"The recording is damaged\. Not read: (run\.bag: )?{named}", line[1])
    assert line[1] in written.printed()
    (listed,) = [run for run in list_runs(bag.parent.parent) if run.name == bag.parent.name]
    assert listed.missing == line[1]


@pytest.mark.usefixtures("without_figures")
def test_a_needle_is_told_with_its_time_and_its_cause(make_bag: MakeBag) -> None:
    """The follower jumps by 3 mm for 20 ms in a move and comes back; nothing else happens."""
    written = write(make_bag(experiments=FIRST, lag_s=0.0, kick=(1.1, 1.12, 0.003)))
    for experiment in written.document["experiments"]:
        (needle,) = experiment["needles"]
        assert needle["at_s"] == pytest.approx(1.11, abs=0.02)
        assert needle["height_mm"] == pytest.approx(3.0, abs=0.2)
        assert needle["timing_ms"] == pytest.approx(
            needle["height_mm"] / needle["tool_speed_m_s"], rel=1e-3
        )
        assert needle["cause"] == "none"
    assert "1 needle (peaks of the distance shorter than 60 ms, violet bands)" in written.page


@pytest.mark.usefixtures("without_figures")
def test_a_pause_of_the_machine_is_told_and_its_error_is_given_apart(make_bag: MakeBag) -> None:
    """The last message comes 0.997 s, the next one 1.041 s after the start of each experiment.

    The follower is 6.5 mm too high in the pause and 0.1 s after it: 1 % of 650 mm.
    """
    options = {"pause": (1.0, 1.04), "kick": (1.0, 1.14, 0.0065)}
    written = write(make_bag(experiments=FIRST, lag_s=0.0, **options))
    for experiment in written.document["experiments"]:
        assert experiment["pauses"] == 1
        assert experiment["longest_pause_ms"] == pytest.approx(44.0, abs=0.01)
        assert experiment["path_error_max_percent"] == pytest.approx(1.0, abs=0.01)
        assert experiment["path_error_max_undisturbed_percent"] < 0.01
    assert "1 pause of the machine, or of the recorder; the longest took 44 ms." in written.page
    assert "without the pauses and the 0.2 s after each: 0.00" in written.page
    assert "real_leads: 1 pause of the machine, or of the recorder" in written.printed()


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
    written = write(make_bag(lag_s=0.0, offset=(0.0, 0.0, 0.00003, 0.0), plant=json.dumps(plant)))
    second = written.document["experiments"][1]
    assert second["positioning_error_max_mm"] == pytest.approx(0.03, abs=1e-3)
    assert second["true_positioning_error_max_mm"] == pytest.approx(0.16, abs=1e-3)
    assert second["true_positioning_error_max_percent"] == pytest.approx(0.0246, abs=2e-4)
    assert second["calibrated_positioning_error_max_mm"] == pytest.approx(0.0, abs=1e-3)
    assert (
        "At rest, against the robot&#39;s true geometry: max 0.160 mm, 0.025 % of reach. "
        "Calibration of lengths and zero offsets would remove 0.160 mm of it and leave 0.000 mm."
    ) in written.page


@pytest.mark.usefixtures("without_figures")
def test_the_configuration_in_the_bag_is_used(
    make_bag: MakeBag, recorded_configuration: str
) -> None:
    """A report of an old bag is judged by the limits of its day, and its robot is understood."""
    files = json.loads(recorded_configuration)
    files["experiments.yaml"] = files["experiments.yaml"].replace(
        "path_error_percent: 2.0", "path_error_percent: 0.01"
    )
    old = files["robot.yaml"].replace("    effort: 300.0", "    inertia: 2.301\n    effort: 300.0")
    files["robot.yaml"] = f"{old}watched_points: []\n"
    report, _, page = write(make_bag(configuration=json.dumps(files), experiments=FIRST))
    assert report.configuration.origin == "in the bag"
    assert "limit 0.01 %" in report.results[0].reasons[0]
    assert "modbus_map.yaml" in page and "Analysed with the configuration in the bag." in page


class _Page(HTMLParser):
    """Collects what a page asks for, and its images."""

    def __init__(self) -> None:
        super().__init__()
        self.images: list[str] = []
        self.asked: list[str] = []
        self.places: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        for name, value in attrs:
            text = value or ""
            if name == "id":
                self.places.append(text)
            elif name in ("src", "href", "data"):
                image = text.startswith("data:image/png;base64,")
                (self.images if image else self.asked).append(text)


def test_the_page_is_self_contained_and_escapes_what_nodes_said(written: Written) -> None:
    """Ten embedded figures, no request, text of a node stays text."""
    page = _Page()
    page.feed(written.page)
    assert len(page.images) == 10
    assert all(asked.startswith("#") for asked in page.asked), "only places of the page itself"
    assert {asked[1:] for asked in page.asked} <= set(page.places)
    text = re.sub(r"<script.*?</script>", "", written.page, flags=re.DOTALL)
    assert "url(" not in text and "@import" not in text
    assert "late &lt;&amp;&gt;" in text and "late <&>" not in text
    assert text.count("WARN: late") == 1, "a warning that stays is listed once"
    for word in ("the real robot moved first", "article", "Versions", "prefers-color-scheme: dark"):
        assert word in text


def test_the_figures_are_images_of_a_readable_size(written: Written) -> None:
    """Blue and orange lines are on the figure of the worst place, and a path has many colours."""
    from matplotlib.image import imread

    paths = imread(written.report.folder / "real_leads_paths.png")[..., :3]
    assert paths.shape[1] > 1000 and len(np.unique(paths.reshape(-1, 3), axis=0)) > 500
    image = imread(written.report.folder / "real_leads_worst.png")
    for color in ("#1667c2", "#ff9a1f"):
        assert close_to(image, color).sum() > 200


def test_a_file_shows_what_the_chart_says(tmp_path: Path) -> None:
    """Lines, bands, limit and names of points: the same description is drawn in the page."""
    from matplotlib.image import imread

    line = chart_line("real - twin", [[0.0, 1.0], [10.0, 1.0]], RED, 4.0)
    pause = BANDS["pause"][0]
    panel = {"y": "apart [mm]", "low": 0.0, "high": 4.0, "series": [line]}
    chart = {"x": "time [s]", "from": 0.0, "to": 10.0, "panels": [panel, panel]}
    told = {**panel, "bands": [[2.0, 4.0, pause]], "limit": 3.0, "percent_of": 650.0}
    named = {**line, "points": True, "data": [[5.0, 2.0, "P1"]]}
    full = {**chart, "panels": [told, {**panel, "series": [named]}]}
    files = write_figures(
        {"plain": lambda: draw_chart(chart), "full": lambda: draw_chart(full)}, tmp_path, "a #2"
    )
    assert [file.name for file in files.values()] == ["a_2_plain.png", "a_2_full.png"]
    plain, told_image = (imread(file) for file in files.values())
    columns = [(close_to(image, pause).sum(axis=0) > 150).sum() for image in (plain, told_image)]
    assert columns[0] < 10 < 100 < columns[1], "the edges of axes are as grey as a pause"
    assert close_to(plain, RED).sum() > 1.5 * close_to(told_image, RED).sum() > 0


def test_the_charts_show_bands_limits_and_each_joint_on_a_scale_of_its_own(
    make_bag: MakeBag, written: Written
) -> None:
    """A lag of 30 ms is some degrees of each joint, up and down, and comes near the limit.

    A pause is a band in both panels of the errors.
    """
    in_page = [json.loads(text) for text in re.findall(r'json">({.*?})</script>', written.page)]
    assert len(in_page) == 6 and "limit" not in in_page[0]["panels"][0]
    _, chosen, results = analyse_bag(
        make_bag(experiments=FIRST, lag_s=0.03, pause=(1.0, 1.04)), CONFIG
    )
    charts = report_charts(results[0], chosen.robot, 2.0)
    errors, joints = charts["errors"]["panels"], charts["deviations"]["panels"]
    assert in_page[1]["panels"][0]["y"] == joints[0]["y"]
    assert errors[0]["limit"] == 13.0
    for panel in errors:
        (band,) = [band for band in panel["bands"] if band[2] == BANDS["pause"][0]]
        assert band[:2] == pytest.approx([0.997, 1.041], abs=2e-3)
    names = [point[2] for line in errors[1]["series"] for point in line["data"] if len(point) > 2]
    assert names == VISITS
    assert [panel["y"] for panel in joints] == ["joint_1 [deg]", "joint_2 [deg]", "joint_3 [mm]"]
    values = [value for _, value in joints[0]["series"][0]["data"]]
    assert -15.0 < min(values) < -0.75 and 0.75 < max(values) < 15.0


def test_the_axis_of_time_holds_what_is_missing_at_the_end(make_bag: MakeBag) -> None:
    """The title names the red band of a side that fell silent: it must be seen too."""
    silent = ("twin/joint_states", 8.0, 1e9)
    _, chosen, results = analyse_bag(make_bag(experiments=FIRST, hole=silent), CONFIG)
    charts = report_charts(results[0], chosen.robot, 2.0)
    bands = charts["errors"]["panels"][0]["bands"]
    (band,) = [band for band in bands if band[2] == BANDS["gap"][0]]
    assert band[0] == pytest.approx(8.0, abs=0.01)
    assert {chart["to"] for chart in charts.values()} == {band[1]}


def test_a_path_shows_its_largest_error_and_no_way_through_a_hole() -> None:
    """Of two instants a piece, and between them a second in which nobody knows where it went."""
    stamps = np.concatenate((np.arange(3000), np.arange(4000, 7000))) / 1000.0
    place, apart = np.repeat(stamps[:, None], 3, axis=1), np.zeros(6000)
    apart[4001] = 5.0
    side, moving = Motion("real", stamps, place, place), np.ones(6000, dtype=bool)
    aligned = Aligned(1000.0, ((0, 3000), (3000, 6000)), side, side, (), 7.0)
    seen = Trace(aligned, place, place, apart, moving, moving)
    figure = draw_paths(Comparison(seen, summarize(apart, 650.0), None, None, None, (), ()), {})
    (lines,) = figure.axes[0].collections
    assert lines.norm.vmax == lines.get_array().max() == 5.0
    lengths = [np.ptp(piece[:, 0]) for piece in lines.get_segments()]
    assert max(lengths) == pytest.approx(2.0) and sum(lengths) == pytest.approx(5998.0)


@pytest.mark.usefixtures("without_figures")
def test_an_experiment_that_was_not_finished_fails_but_is_reported(make_bag: MakeBag) -> None:
    """A crash in the middle costs the verdict, not the figures."""
    path = make_bag()
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 3])
    report, _, page = write(path)
    assert "the recording ends before the experiment does" in report.results[0].reasons
    comparison = report.results[0].comparison
    assert comparison is not None and comparison.path.max_mm > 0.0
    assert "a repaired copy was read" in page


@pytest.mark.usefixtures("without_figures")
def test_a_recording_without_marks_is_one_experiment(make_bag: MakeBag) -> None:
    """Whoever moved first leads, nobody asked for positions, and the error is the same."""
    options: dict[str, Any] = {"experiments": ("twin_leads",), "lag_s": 0.004}
    _, document, page = write(make_bag(without=("experiment/marker",), **options))
    marked = write(make_bag(**options)).document["experiments"][0]
    (found,) = document["experiments"]
    assert (found["name"], found["leader"], found["verdict"]) == ("recording", "twin", "pass")
    assert found["path_error_max_mm"] == pytest.approx(marked["path_error_max_mm"], rel=1e-3)
    assert (found["visits"], found["held"]) == ([], [])
    assert "Good: real robot and twin moved as one in the experiment" in page


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
    (found,) = write(maker.write(tmp_path / "run.bag")).document["experiments"]
    assert found["leader"] == "twin"


@pytest.mark.usefixtures("without_figures")
def test_a_recording_of_a_real_robot_has_its_readings_in_place_of_the_truth(
    make_bag: MakeBag,
) -> None:
    """Nobody knows the truth there; the page says which it is."""
    report, _, page = write(make_bag(experiments=("real_leads",), real="real/joint_states"))
    assert report.passed
    assert "what the twin controller read from the robot" in page


@pytest.mark.usefixtures("without_figures")
def test_repeated_experiments_are_reported_each_and_together(make_bag: MakeBag) -> None:
    """A row for each repeat, and one of their name; test_repeats.py holds its figures."""
    report, document, page = write(make_bag(experiments=FIRST * 2))
    assert [e["repeat"] for e in document["experiments"]] == [1, 2]
    (summary,) = document["repeats"]
    assert summary["repeats"] == summary["passed"] == 2
    assert report.results[1].span.label == "real_leads #2"
    assert "Repeats" in page
