"""The pendant page's connection: what it shows, what its keys do, and that it comes back."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any, ClassVar

import pytest
from fanuc_emulator.pendant import pendant_station_io as pendant_station
from fanuc_emulator.pendant.pendant_link_io import PendantError, PendantLink
from fanuc_emulator.pendant.pendant_station_io import PendantStation, expire_heartbeat
from fanuc_emulator.pendant.pendant_view_io import _change_override
from harness.emulated.served import running
from harness.followed import FOLLOW_MAP
from harness.processes import wait_until
from harness.workspace import ROOT
from scara_config import load_robot
from scara_config.modbus_map import load_modbus_map

ROBOT, LAYOUT = load_robot(ROOT / "config"), load_modbus_map(ROOT / "config")


class Link:
    """A robot that can be unplugged."""

    there, lacks = True, ""
    written: ClassVar[list[tuple[str, Any]]] = []

    def __init__(self, *_: object) -> None:
        pass

    def __enter__(self) -> Link:
        return self._here()

    def __exit__(self, *_: object) -> None:
        pass

    def _here(self) -> Link:
        if not Link.there:
            raise PendantError("no robot at 1.2.3.4:502: is the emulator running?")
        return self

    def read(self, name: str) -> Any:
        """Return a register."""
        self._here()
        if name == Link.lacks:
            return ""
        many = {
            "position": [1.0, 2.0, -3.0, 4.0, 5.0, 0, 0, 0, 0],
            "velocity": [0.5] * 9,
            "program_name": "ARTICLE",
        }
        return many.get(name, [2])

    def write(self, name: str, values: list[int]) -> None:
        """Remember."""
        Link.written.append((name, values))

    def outputs(self) -> dict[str, bool]:
        """Return UO."""
        return {"progrun": True}

    def signal(self, name: str) -> bool:
        """Return the level of an input."""
        return name != "enbl"

    def mode(self) -> str:
        """Return at what the mode switch stands."""
        return "T1"

    def alarm(self) -> str:
        """Return the alarm."""
        return "SRVO-037"


@pytest.fixture
def station(monkeypatch: pytest.MonkeyPatch) -> Iterator[PendantStation]:
    """Give a station at a robot that is there."""
    monkeypatch.setattr(pendant_station, "PendantLink", Link)
    monkeypatch.setattr(pendant_station, "RETRY_S", 0.01)
    Link.there, Link.lacks, Link.written = True, "", []
    with PendantStation("1.2.3.4", 502, LAYOUT, ROBOT) as made:
        wait_until(lambda: not made.reading.trouble, 5.0, "a reading")
        yield made


def test_display_shows_joints_program_lamps_and_alarm(station: PendantStation) -> None:
    """As the controller reports them, in deg and mm."""
    reading = station.reading
    assert reading.rows[2] == ("joint_3", -3.0, 0.5, "mm")
    assert reading.program == "ARTICLE  line 2  running"
    assert (
        reading.override == 2
        and reading.mode == "T1"
        and reading.alarm == "SRVO-037"
        and reading.lamps["progrun"]
    )
    assert reading.switches == {
        "panel_imstp": True,
        "panel_hold": True,
        "sfspd": True,
        "enbl": False,
    }


def test_robot_that_shows_no_speeds_is_displayed_without(station: PendantStation) -> None:
    """A robot of the kit's map has none; its positions are shown all the same."""
    Link.lacks = "velocity"
    wait_until(lambda: station.reading.rows[2] == ("joint_3", -3.0, None, "mm"), 5.0, "no speed")
    assert not station.reading.trouble


def test_override_keys_count_from_what_is_in_force(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever the display shows: before its first reading it shows none."""
    monkeypatch.setattr(pendant_station, "PendantLink", Link)
    monkeypatch.setattr(Link, "written", [])
    looking = PendantStation("1.2.3.4", 502, LAYOUT, ROBOT)
    assert looking.press(partial(_change_override, 5)) == ""
    assert Link.written == [("override", [7])]


@pytest.mark.parametrize(
    ("key", "reason"),
    [
        (expire_heartbeat, "this robot's map has no register heartbeat"),
        (lambda link: link.set_signal("sfspd", False), "this robot has no command for sfspd"),
        (lambda link: link.pulse("start"), "this robot has no command for start"),
    ],
)
def test_key_that_a_followed_robot_lacks_says_so(
    key: Callable[[PendantLink], None], reason: str
) -> None:
    """Of a robot that is only followed nothing but its own panel is written."""
    with running(tell=lambda _: None) as stand_in:
        station = PendantStation("127.0.0.1", stand_in.port, FOLLOW_MAP, ROBOT)
        assert station.press(key) == reason


def test_lost_robot_is_said_and_found_again(station: PendantStation) -> None:
    """Nobody has to load the page anew."""
    Link.there = False
    wait_until(lambda: "no robot at" in station.reading.trouble, 5.0, "the loss")
    Link.there = True
    wait_until(lambda: not station.reading.trouble, 5.0, "the robot")


def test_key_that_cannot_act_says_why(station: PendantStation) -> None:
    """It raises nothing into the page."""

    def key(_: object) -> None:
        raise PendantError("the robot refuses")

    assert station.press(key) == "the robot refuses"
    assert station.press(lambda link: link.write("override", [50])) == ""
    assert Link.written == [("override", [50])]


def test_injected_heartbeat_is_one_that_arms_the_watchdog(station: PendantStation) -> None:
    """1 to 32767; 0 would disarm it."""
    assert station.press(expire_heartbeat) == ""
    ((name, (value,)),) = Link.written
    assert name == "heartbeat" and 1 <= value <= 32767
