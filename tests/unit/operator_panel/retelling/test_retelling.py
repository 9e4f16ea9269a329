"""A recording is told again: what the page would have shown at each of its moments."""

from __future__ import annotations

import math
from datetime import datetime
from pathlib import Path

import msgspec
import pytest
import rosbag
from cell_recorder.reading.bag_reader_io import BagError, open_bag
from harness.page import recorded
from harness.page.recorded import LENGTH_S, START, STOPS_S
from harness.workspace import ROOT
from operator_panel.config import load_surroundings
from operator_panel.retelling.bag_teller_io import lines_of
from operator_panel.retelling.lines import LENGTH, Happened, Told, packed, unpacked
from operator_panel.retelling.recorded_past import EVENTS_SHOWN, RecordedLook, RecordedPast
from operator_panel.retelling.retelling import FINEST_S, MOST, Retelling
from operator_panel.view.frame import FrameMaker
from scara_config import load_robot
from std_msgs.msg import String

from scara_description.urdf import parse_urdf
from scara_msgs.msg import Decision, TwinControllerState

ROBOT = load_robot()
SILENT_S, WINDOW_S = 0.6, 20.0


@pytest.fixture(scope="module")
def maker() -> FrameMaker:
    """Return what makes the page's frames."""
    model = parse_urdf(ROBOT.description.read_text(encoding="utf-8"))
    alarm_mm = load_surroundings(ROBOT, ROOT / "config").alarm_mm
    return FrameMaker(ROBOT, model, SILENT_S, alarm_mm)


def past_of(bag: Path, maker: FrameMaker) -> RecordedPast:
    """Return a recording after it has gone through the pipe."""
    past = RecordedPast("my_run", maker)
    for line in lines_of(bag, SILENT_S):
        past.take(unpacked(packed(line)[LENGTH:]))
    return past


@pytest.fixture(scope="module")
def past(tmp_path_factory: pytest.TempPathFactory, maker: FrameMaker) -> RecordedPast:
    """Return the short recording."""
    folder = tmp_path_factory.mktemp("run")
    return past_of(recorded.write_recording(folder / "run.bag", ROBOT), maker)


def look(past: RecordedPast, after: float) -> RecordedLook:
    """Return the moment ``after`` [s] behind the start."""
    found = past.look(START + after, WINDOW_S)
    assert found is not None
    assert found.at == pytest.approx(START + after, abs=FINEST_S)
    return found


@pytest.mark.parametrize(
    ("after", "mode", "leads"), [(2.0, "Ready", ""), (6.0, "Real robot leads", "leads")]
)
def test_moment_shows_who_led_and_where_the_robots_stood(
    past: RecordedPast, after: float, mode: str, leads: str
) -> None:
    """As the page's own frame says it."""
    found = look(past, after)
    assert found.frame.text["mode"] == mode
    assert leads in found.frame.text["lead.real"]
    pose = found.frame.pose["twin"]["joint_1"]
    assert math.degrees(pose) == pytest.approx(recorded.joint_1_deg(after), abs=1.1)
    assert (found.run, found.note) == ("my_run", "")


def test_reason_of_a_stop_is_among_the_events_of_its_moment_and_not_before(
    past: RecordedPast,
) -> None:
    """It answers why the pair stopped at 14:03."""
    before = [event.text for event in look(past, STOPS_S - 0.5).events]
    after = [event.text for event in look(past, STOPS_S + 0.5).events]
    assert not any(recorded.REASON in text for text in before)
    assert any(recorded.REASON[1:] in text for text in after)
    sources = {event.source for event in look(past, LENGTH_S).events}
    assert sources == {"experiment", "simulator: physics", "twin controller", "gateway/operator"}
    texts = [event.text for event in look(past, LENGTH_S).events]
    assert f"STOP: {recorded.REASON}" in texts and "start of a test" in texts
    assert any(text.startswith("Over: ") for text in texts), "the warning came and went"


def test_charts_look_back_from_the_moment_with_what_a_recording_holds(past: RecordedPast) -> None:
    """Set points and errors of the loops are in none; measured positions and efforts are."""
    found = look(past, 6.0)
    times = [time for time, _ in found.rows]
    assert times == sorted(times) and times[-1] == pytest.approx(6.0, abs=FINEST_S)
    real, twin, set_point, measured, error, effort = found.rows[-1][1]["joint_1"]
    assert real == twin == pytest.approx(measured, abs=1e-3)
    assert (set_point, error, effort) == (None, None, recorded.EFFORT)
    assert found.frame.point == {}, "points come as rows"


def test_parts_are_where_they_were(past: RecordedPast) -> None:
    """Of both sides, if both were recorded."""
    first, later = look(past, 0.5).parts, look(past, 9.5).parts
    assert [part.name for part in first["twin"]] == ["part_1"] and "real" not in first
    assert first["twin"][0].position[0] == pytest.approx(0.3)
    assert later["twin"][0].position[0] == pytest.approx(0.39)


def test_ends_of_the_recording_are_known_before_it_is_read(past: RecordedPast) -> None:
    """So that a page can say how much is still to come."""
    found = look(past, 0.0)
    assert found.ends == pytest.approx(START + LENGTH_S)
    assert found.first == pytest.approx(START, abs=FINEST_S)
    assert found.last == pytest.approx(START + LENGTH_S, abs=FINEST_S)
    assert past.head is not None and past.head.robot == ROBOT.name


def test_moment_at_which_the_controller_was_silent_says_so(
    tmp_path: Path, maker: FrameMaker
) -> None:
    """What it said last is not taken for that moment's."""
    found = past_of(recorded.write_recording(tmp_path / "run.bag", ROBOT, silent=6.0), maker)
    assert "silent since" in look(found, 9.0).note
    assert look(found, 9.0).frame.text["mode"] == "Real robot leads"
    assert look(found, 9.0).rows[-1][1] == {}


def test_long_recording_has_no_more_moments_than_memory_is_meant_for() -> None:
    """Half a day is told in larger steps."""
    half_a_day = 12 * 3600.0
    retelling = Retelling(START, START + half_a_day, SILENT_S)
    assert retelling.period * MOST == pytest.approx(half_a_day)
    assert Retelling(START, START + 60.0, SILENT_S).period == FINEST_S
    count = 0
    while (moment := retelling.due(START + half_a_day)) is not None:
        told = [line for line in retelling.lines(moment) if isinstance(line, Told)]
        count += len(told)
    assert count == MOST + 1


def test_events_that_go_with_a_moment_are_the_newest(maker: FrameMaker, tmp_path: Path) -> None:
    """A long recording's list does not grow with each step of the slider."""
    retelling = Retelling(START, START + 60.0, SILENT_S)
    past = RecordedPast("my_run", maker)
    past.take(retelling.head(""))
    state = recorded.state(ROBOT, 0.0)
    retelling.take("twin_controller/state", START, state)
    for number in range(3 * EVENTS_SHOWN):
        retelling.take("experiment/marker", START, String(f"mark {number}"))
    for line in retelling.lines(START):
        past.take(line)
    texts = [event.text for event in look(past, 0.0).events]
    assert len(texts) == EVENTS_SHOWN
    assert texts[0] == f"mark {3 * EVENTS_SHOWN - 1}"


def test_a_decision_that_is_told_after_midnight_keeps_its_day() -> None:
    """The moments of a recording come some time after what happened."""
    midnight = datetime(2026, 3, 2).timestamp()
    retelling = Retelling(midnight - 60.0, midnight + 60.0, SILENT_S)
    retelling.take("twin_controller/decisions", midnight - 0.01, Decision())
    told = [line for line in retelling.lines(midnight + 0.04) if isinstance(line, Happened)]
    assert [line.event.time for line in told] == ["2026-03-01T23:59:59"]


def test_state_before_the_first_message_is_no_data(maker: FrameMaker) -> None:
    """And raises no alarm: nobody knows what was wrong."""
    retelling = Retelling(START, START + 1.0, SILENT_S)
    assert not [line for line in retelling.lines(START) if isinstance(line, Happened)]


def test_bag_that_no_page_can_show_is_refused(tmp_path: Path, maker: FrameMaker) -> None:
    """With what it holds instead."""
    with rosbag.Bag(str(tmp_path / "run.bag"), "w") as bag:
        bag.write("/chatter", String("hello"), recorded.time(0.0))
    with pytest.raises(BagError, match=r"no message of twin_controller/state.*chatter"):
        list(lines_of(tmp_path / "run.bag", SILENT_S))
    (tmp_path / "no.bag").write_bytes(b"x" * 2048)
    with pytest.raises(BagError, match="no readable bag"):
        list(lines_of(tmp_path / "no.bag", SILENT_S))


def test_several_topics_are_read_in_the_order_of_receipt(tmp_path: Path) -> None:
    """And a message that nobody reads is not decoded."""
    bag_path = recorded.write_recording(tmp_path / "run.bag", ROBOT)
    with open_bag(bag_path) as bag:
        rows = list(bag.merged(["twin_controller/state", "experiment/marker", "not/there"]))
        times = [at for at, _, _ in rows]
        assert times == sorted(times)
        marks = [read().data for _, topic, read in rows if topic == "experiment/marker"]
        assert marks == ["start of a test"]
        states = [read for _, topic, read in rows if topic == "twin_controller/state"]
        assert states[0]().mode == TwinControllerState.IDLE


def test_line_that_is_none_is_refused() -> None:
    """The page's server says that the recording cannot be read."""
    with pytest.raises(msgspec.DecodeError):
        unpacked(b"\xc1 no line")
