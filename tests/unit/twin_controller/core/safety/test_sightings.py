"""Sightings of people: their age, what is refused, several sensors."""

from __future__ import annotations

import math

import pytest
from harness.pair import HOME, ROBOT, SETUP, Pair, ramp, seen_pair, shifted
from msgspec.structs import replace
from twin_controller.core.events import PersonSeen
from twin_controller.core.lead.modes import Mode
from twin_controller.core.safety.sightings import (
    Sighting,
    SightingError,
    newest,
    note_stranger,
    sensor_of,
    sighting_age,
)
from twin_controller.core.setup import Setup
from twin_controller.view import alarm_text

MOST_STRANGERS = 20
HERE = (2.0, 0.0, 0.0)
SENSORS = ("left", "right")
SEPARATION = replace(SETUP.config.separation, enabled=True, sensors=SENSORS)
WATCHED = Setup(ROBOT, replace(SETUP.config, separation=SEPARATION))
FAR = 8.0
BOTH_FAR = dict.fromkeys(SENSORS, FAR)


@pytest.mark.parametrize(
    ("stamp", "age"), [(1000.0, 0.0), (999.75, 0.25), (1000.5, 0.0), (1.0, 999.0)]
)
def test_a_late_sighting_is_as_old_as_its_stamp(stamp: float, age: float) -> None:
    """However it was delayed; one from the future is new."""
    assert sighting_age("/base_link", stamp, HERE, 1000.0, "base_link") == pytest.approx(age)


@pytest.mark.parametrize(
    ("frame", "stamp", "position", "reason"),
    [
        ("camera", 1.0, HERE, "frame 'camera', expected 'base_link'"),
        ("base_link", 0.0, HERE, "stamp 0 s, expected the time at which the person was there"),
        ("base_link", math.nan, HERE, "stamp nan s"),
        ("base_link", 1.0, (0.0, math.nan, 0.0), r"position \(0.0, nan, 0.0\) is not finite"),
        ("base_link", 1.0, (math.inf, 0.0, 0.0), "is not finite"),
    ],
)
def test_a_sighting_that_cannot_be_used_is_refused_with_the_reason(
    frame: str, stamp: float, position: tuple[float, float, float], reason: str
) -> None:
    """It counts as none."""
    with pytest.raises(SightingError, match=reason):
        sighting_age(frame, stamp, position, 1000.0, "base_link")


def test_of_each_sensor_the_newest_sighting_is_kept() -> None:
    """One that arrives after a newer one is dropped; sensors do not replace each other's."""
    people = newest((), Sighting(2.0, HERE, "left"), SENSORS)
    people = newest(people, Sighting(1.0, (9.0, 0.0, 0.0), "left"), SENSORS)
    assert people == (Sighting(2.0, HERE, "left"),)
    people = newest(people, Sighting(3.0, (1.0, 0.0, 0.0), "right"), SENSORS)
    assert {person.sensor: person.seen for person in people} == {"left": 2.0, "right": 3.0}
    assert newest(people, Sighting(4.0, HERE, "left"), SENSORS)[-1] == Sighting(4.0, HERE, "left")


@pytest.fixture
def moving() -> Pair:
    """Return a pair whose real robot leads a long program, two sensors seeing a far person."""
    pair = seen_pair(BOTH_FAR, WATCHED)
    pair.start_program(ramp(HOME, shifted(HOME, 40.0), 8.0))
    pair.see(BOTH_FAR, 0.5)
    assert pair.mode is Mode.REAL_LEADS
    return pair


def test_a_sighting_that_is_older_than_allowed_when_it_arrives_is_none(moving: Pair) -> None:
    """Latched or queued: they come twenty times a second all the same."""
    moving.see(BOTH_FAR, 0.5, age=0.5)
    assert moving.mode is Mode.PAUSED and "silent" in moving.why


def test_a_sighting_without_an_age_is_of_now() -> None:
    """Who measures at once needs not say it."""
    pair = seen_pair(BOTH_FAR, WATCHED)
    pair.feed(PersonSeen(pair.now, HERE, sensor="left"))
    seen = {person.sensor: person for person in pair.state.safety.people}
    assert seen["left"] == Sighting(pair.now, HERE, "left")


def test_the_nearest_person_of_all_sensors_counts(moving: Pair) -> None:
    """Whichever sensor speaks last."""
    moving.see({"left": 0.9, "right": FAR}, 0.3)
    assert moving.mode is Mode.PAUSED and "a person is" in moving.why


def test_one_sensor_that_falls_silent_stops_the_pair_until_it_is_back(moving: Pair) -> None:
    """The other still sees nobody near; what the silent one watched is not known."""
    moving.see({"right": FAR}, 0.6)
    assert moving.mode is Mode.PAUSED and "sensor left that sees people is silent" in moving.why
    moving.see({"right": FAR}, 2.0)
    assert not moving.operate("RESUME").success
    moving.see(BOTH_FAR, 0.2)
    moving.do("RESUME")


def test_a_thousand_senders_that_nobody_named_lock_no_cell_and_fill_no_memory() -> None:
    """As `rostopic pub` does, with a new name each time: near people, then silence."""
    pair = seen_pair(BOTH_FAR, WATCHED)
    for number in range(1000):
        pair.feed(PersonSeen(pair.now, (0.3, 0.0, 0.0), 0.0, f"/rostopic_{number}_1767"))
    assert {person.sensor for person in pair.state.safety.people} == set(SENSORS)
    pair.start_program(ramp(HOME, shifted(HOME, 40.0), 4.0))
    pair.see(BOTH_FAR, 2.0)
    assert pair.mode is Mode.REAL_LEADS and pair.real_q[0] > HOME[0] + 0.2


def test_unknown_senders_are_said_once_and_after_some_no_more() -> None:
    """Their names are no memory that grows."""
    strangers: tuple[str, ...] = ()
    said = []
    for number in range(1000):
        for _ in range(2):
            strangers, text = note_stranger(strangers, f"/rostopic_{number}")
            said += [text] if text else []
    assert len(said) == len(strangers) == MOST_STRANGERS + 1
    assert "/rostopic_0 is dropped: separation.sensors" in said[0]
    assert [text for text in said if "more unknown senders" in text] == said[-1:]


@pytest.mark.parametrize(
    ("caller", "sensor"),
    [
        ("/cell_2/scanner", "scanner"),
        ("/scanner", None),
        ("/hall/camera", "/hall/camera"),
        ("/cell_2/hall/camera", None),
        ("/cell_2/scanner_1_2", None),
    ],
)
def test_a_name_is_of_the_cells_own_node_unless_it_begins_with_a_slash(
    caller: str, sensor: str | None
) -> None:
    """As all names of ROS."""
    assert sensor_of(caller, "/cell_2/", ("scanner", "/hall/camera")) == sensor


def test_the_pair_aligns_once_each_named_sensor_was_heard() -> None:
    """Before, one that was heard only after the robot stopped the pair at its start."""
    pair = Pair(setup=WATCHED)
    pair.link("real", True)
    pair.link("twin", True)
    pair.see({"left": FAR}, 2.0)
    assert pair.mode is Mode.OFFLINE
    assert "waits to align: the sensor right" in alarm_text(pair.setup, pair.state, pair.now)
    pair.see(BOTH_FAR, 2.5)
    assert pair.mode is Mode.IDLE
    assert "TOO_CLOSE" not in pair.triggers()
