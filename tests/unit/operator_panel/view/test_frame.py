"""The frame that the pages get says what the cell says."""

from __future__ import annotations

import json
import math
from typing import Any

import msgspec
import pytest
from harness.workspace import ROOT
from operator_panel.view import words
from operator_panel.view.frame import FrameMaker
from operator_panel.view.past import History
from operator_panel.view.snapshot import (
    CellState,
    Link,
    Loop,
    RobotPackage,
    RobotStatus,
    Sighting,
    Snapshot,
)
from scara_config import load_robot

from scara_description.urdf import parse_urdf

ROBOT = load_robot(ROOT / "config")
MODEL = parse_urdf(
    (ROOT / "src" / "scara_description" / "urdf" / "scara_cell.urdf").read_text(encoding="utf-8")
)
MAKER = FrameMaker(ROBOT, MODEL, 0.6, (20.0, 2.0))
NAMES = tuple(joint.name for joint in ROBOT.twin_joints)
NOW = 50.0
STATUS = RobotStatus(2, 0, 1, 1, 0, 0)
STATE = CellState(
    mode="REAL_LEADS",
    leader="real",
    why="the real robot moved first: the twin follows",
    name=NAMES,
    unit=("deg", "deg", "mm", "deg"),
    real_position=(90.0, 0.0, -10.0, 0.0),
    twin_position=(89.5, 0.0, -10.0, -180.0),
    deviation=(0.5, 0.0, 0.0, 180.0),
    speed_requested_percent=90.0,
    speed_applied_percent=80.0,
    speed_limited=True,
    speed_reason="above 80 %",
    links=(
        Link("real", True, "", 0.004, 0.0003, 1.8e9, 0.0002, -3.24),
        Link("twin", False, "refused"),
    ),
)


def frame_of(state: CellState = STATE, received: float = NOW, **fields: Any) -> dict[str, Any]:
    """Return the frame as a page gets it."""
    snapshot = Snapshot(True, state, received, silent_since="12:00:00", **fields)
    decoded: dict[str, Any] = json.loads(msgspec.json.encode(MAKER.make(snapshot, NOW)))
    return decoded


@pytest.mark.parametrize("leader", ["real", "twin", "operator", ""])
def test_tools_poses_number_and_chart_are_one_distance(leader: str) -> None:
    """Whoever leads: of one instant, nothing removed."""
    real, twin = (0.5123456, 0.1, 0.05), (0.5101234, 0.0987, 0.0502)
    apart = 1e3 * math.dist(real, twin)
    state = msgspec.structs.replace(
        STATE, leader=leader, real_tool=real, twin_tool=twin, deviation_mm=apart
    )
    frame = frame_of(state)
    text, tool, point = frame["text"], frame["tool"], frame["point"]
    assert text["deviation"] == f"{apart:.2f} mm"
    assert 1e3 * math.dist(tool["real"], tool["twin"]) == pytest.approx(apart, abs=0.005)
    assert point["pair"][0] == pytest.approx(apart, abs=1e-4)
    assert text["tool.real"] == "x 512.3  y 100.0  z 50.0 mm"


def test_unknown_distance_is_no_distance() -> None:
    """While a line is down the poses are those last heard, and no number claims to compare them."""
    frame = frame_of(msgspec.structs.replace(STATE, leader="", mode="OFFLINE"))
    text, tool, tone = frame["text"], frame["tool"], frame["tone"]
    assert text["deviation"] == f"{words.UNKNOWN} mm" and tone["deviation"] == ""
    assert set(tool) == {"real", "twin"} and frame["gauge"] == {"deviation": 0.0}


@pytest.mark.parametrize(
    ("leader", "apart", "share", "tone", "limit"),
    [
        ("real", 5.0, 0.25, "good", "alarm from 20 mm"),
        ("real", 15.0, 0.75, "warn", "alarm from 20 mm"),
        ("twin", 21.0, 1.0, "bad", "alarm from 20 mm"),
        ("", 0.5, 0.25, "good", "alarm from 2 mm"),
        ("", 5.45, 1.0, "bad", "alarm from 2 mm"),
    ],
)
def test_number_gauge_and_colour_follow_the_limit_that_holds_now(
    leader: str, apart: float, share: float, tone: str, limit: str
) -> None:
    """A pair at rest may be less far apart than one that moves; a full bar is never green."""
    frame = frame_of(msgspec.structs.replace(STATE, leader=leader, deviation_mm=apart))
    assert frame["gauge"] == {"deviation": share}
    assert frame["tone"]["deviation"] == tone
    assert frame["text"]["deviation.limit"] == limit


@pytest.mark.parametrize(
    ("mode", "leader", "roles"),
    [
        ("REAL_LEADS", "real", ("leads", "\N{RIGHTWARDS ARROW}", "follows")),
        ("TWIN_LEADS", "twin", ("follows", "\N{LEFTWARDS ARROW}", "leads")),
        ("PAUSED", "real", ("is held", "\N{MIDDLE DOT}", "is held")),
        ("ALIGNING", "", ("waits", "\N{RIGHTWARDS ARROW}", "comes closer")),
        ("IDLE", "", ("waits", "\N{MIDDLE DOT}", "waits")),
    ],
)
def test_arrow_points_to_whoever_follows(mode: str, leader: str, roles: tuple[str, ...]) -> None:
    """Both robots say what they do."""
    text = frame_of(msgspec.structs.replace(STATE, mode=mode, leader=leader))["text"]
    assert tuple(text[f"lead.{key}"] for key in ("real", "arrow", "twin")) == roles


@pytest.mark.parametrize(
    ("place", "text"),
    [
        ("joint_1.real", "90.00"),
        ("joint_1.twin", "89.50"),
        ("joint_1.deviation", "+0.50"),
        ("mode", "Real robot leads"),
        ("why", "The real robot moved first: the twin follows"),
        ("speed.applied", "80 %"),
        ("speed.reason", "90 % asked for; lowered: above 80 %"),
        ("link.real.figures", "values 4 ms old, answers in under 1 ms, clock within under 1 ms"),
        ("link.twin.state", "refused"),
        ("link.twin.figures", "no values come"),  # an old age would look like a good one
        ("robot.program", "ARTICLE line 3 running"),
        ("robot.speed", "50 %"),
        ("robot.ready", "ready"),
    ],
)
def test_place_of_the_page_says_what_the_cell_says(place: str, text: str) -> None:
    """The article's rounding and package; no code is shown for what has a name."""
    package = RobotPackage("program", 50.0, True, True, "ARTICLE line 3 running")
    assert frame_of(package=package)["text"][place] == text


def test_what_an_unheard_robot_said_last_is_not_of_now() -> None:
    """Its line was lost: it neither runs nor is ready, nor can be started from here."""
    package = RobotPackage("program", 50.0, True, True, "ARTICLE line 3 running")
    package = msgspec.structs.replace(package, operation_mode="AUTO")
    assert "can be started" in frame_of(package=package, status=STATUS)["text"]["status.mode"]
    lost = msgspec.structs.replace(STATE, mode="OFFLINE", leader="", real_position=(), deviation=())
    frame = frame_of(lost, package=package, status=STATUS)
    text = frame["text"]
    said = {text[f"robot.{key}"] for key in ("program", "speed", "ready")}
    assert said == {words.UNKNOWN} and "program" not in frame
    assert "can be started" not in text["status.mode"]


@pytest.mark.parametrize(
    ("place", "tone"),
    [("speed.applied", "warn"), ("link.real.state", "good"), ("link.twin.state", "bad")],
)
def test_what_is_limited_or_down_is_marked(place: str, tone: str) -> None:
    """By its colour."""
    assert frame_of()["tone"][place] == tone


def test_poses_are_in_si_and_tools_where_the_kinematics_say() -> None:
    """At 90 degrees the straight arm points along y."""
    frame = frame_of()
    assert frame["pose"]["real"]["joint_1"] == pytest.approx(math.pi / 2, abs=1e-6)
    assert frame["pose"]["real"]["joint_3"] == pytest.approx(-0.01)
    assert frame["tool"]["real"] == pytest.approx([0.0, 0.65, 0.15], abs=1e-5)


def test_bars_are_shares_of_the_range() -> None:
    """The lower limit is 0, the upper 1."""
    bar = frame_of()["bar"]
    assert bar["joint_2"] == [0.5, 0.5] and bar["table_joint"] == [0.5, 0.0]


def test_unknown_side_is_a_dash_and_no_pose() -> None:
    """While a link is down only the other side is known."""
    frame = frame_of(msgspec.structs.replace(STATE, twin_position=(), deviation=()))
    assert (
        frame["text"]["joint_1.twin"] == "\N{EN DASH}"
        and frame["text"]["tool.twin"] == "\N{EN DASH}"
    )
    assert set(frame["pose"]) == {"real"} and frame["bar"]["joint_1"][1] is None


@pytest.mark.parametrize("known", [True, False])
def test_page_says_before_a_press_that_no_stop_gets_through(known: bool) -> None:
    """And what to do instead, whether the twin controller was ever heard or not."""
    snapshot = Snapshot(state=STATE if known else None, received=NOW, no_stop="roscore is gone")
    text = MAKER.make(snapshot, NOW).no_stop
    assert "use the stop at the robot" in text and "Roscore is gone" in text
    assert "no_stop" not in frame_of(), "while it gets through there is nothing to say"


def test_silent_controller_is_said_with_its_time_and_stops_the_charts() -> None:
    """Old values are no new points."""
    frame = frame_of(received=NOW - 1.0)
    assert "silent since 12:00:00" in str(frame["silent"]) and "point" not in frame


def test_points_are_in_the_joints_unit_and_its_effort() -> None:
    """Set point, measured and error of the PID loop come in SI."""
    loops = {
        "joint_1": Loop(math.pi, math.pi / 2, math.pi / 2, 12.5, NOW),
        "joint_3": Loop(-0.1, math.nan, 0.001, 1.0, NOW),
    }
    point = frame_of(loops=loops)["point"]
    assert point["joint_1"] == [90.0, 89.5, 180.0, 90.0, 90.0, 12.5]
    assert point["joint_3"] == [-10.0, -10.0, -100.0, None, 1.0, 1.0]
    assert point["joint_2"] == [0.0, 0.0, None, None, None, None]


def test_loop_that_says_nothing_is_a_gap_in_its_chart() -> None:
    """A jog opens it, or the simulator has died: what it said last is not of now."""
    heard = {"joint_1": NOW - 0.5, "joint_2": NOW - 0.7}
    loops = {name: Loop(0.0, 0.0, 0.0, 1.0, received) for name, received in heard.items()}
    point = frame_of(loops=loops)["point"]
    assert point["joint_1"] == [90.0, 89.5, 0.0, 0.0, 0.0, 1.0]
    assert point["joint_2"] == [0.0, 0.0, None, None, None, None]


@pytest.mark.parametrize(
    ("master", "why"), [(True, "Waiting for the twin controller"), (False, "No ROS master")]
)
def test_before_the_first_state_the_page_says_what_it_waits_for(master: bool, why: str) -> None:
    """Any start order works."""
    frame = MAKER.make(Snapshot(master=master), NOW)
    assert why in frame.text["why"] and frame.silent


def test_history_keeps_its_window_at_its_rate() -> None:
    """A page that opens later sees the same charts."""
    history = History(window_s=2.0, rate_hz=10.0)
    frame = MAKER.make(Snapshot(master=True, state=STATE, received=NOW), NOW)
    taken = [history.add(k * 0.05, frame.point) for k in range(100)]
    times = [t for t, _ in history.rows]
    assert sum(taken) == 50 and times[-1] - times[0] <= 2.0 and len(times) == 21


def test_points_of_the_pair_are_its_distance_speed_and_lag() -> None:
    """In mm, percent and ms; what is not known is left out of a chart."""
    state = msgspec.structs.replace(
        STATE,
        deviation_mm=math.nan,
        speed_applied_percent=40.0,
        speed_requested_percent=60.0,
        lag=0.0081,
    )
    assert frame_of(state)["point"]["pair"] == [None, 40.0, 60.0, 8.1]


def test_history_takes_no_frame_without_points() -> None:
    """While the controller is silent."""
    history = History(2.0, 10.0)
    assert not history.add(NOW, MAKER.points(Snapshot(), NOW)) and history.rows == []


def test_people_are_in_the_frame_for_a_second() -> None:
    """Each sensor's nearest one; one that nobody has seen since is not shown."""
    people = {
        "/front": Sighting((0.9, 0.1, 0.2), NOW - 1.0),
        "/back": Sighting((-0.9, 0.1, 0.2), NOW - 1.1),
    }
    assert frame_of(people=people)["people"] == [[0.9, 0.1, 0.2]]
    assert "people" not in frame_of()


def test_a_speed_that_the_robot_does_not_tell_is_no_number() -> None:
    """A robot without programs of ours tells its override alone."""
    unknown = float("nan")
    told = {"speed_requested_percent": unknown, "speed_applied_percent": unknown}
    state = msgspec.structs.replace(STATE, speed_limited=False, **told)
    text = frame_of(state)["text"]
    assert text["speed.applied"] == "\N{EN DASH} %"
    assert text["speed.reason"] == "the robot does not tell its program's speed"
