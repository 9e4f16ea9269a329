"""What is wrong is listed once, worst first, with what to do."""

from __future__ import annotations

import pytest
from operator_panel.view.alarms import ELSE, active_alarms, remedy
from operator_panel.view.snapshot import CellState, Diagnosis, Snapshot

NOW = 100.0


def heard(state: CellState | None = None, *diagnoses: Diagnosis, received: float = NOW) -> Snapshot:
    """Make a snapshot of a cell with a master."""
    return Snapshot(
        master=True,
        state=state or CellState("IDLE"),
        received=received,
        silent_since="12:00:00",
        diagnoses={d.name: d for d in diagnoses},
    )


OLD, SMALL, GREAT = (
    Diagnosis(2, "/a", "old", NOW - 4.0),
    Diagnosis(1, "/a", "small", NOW),
    Diagnosis(2, "/b", "great", NOW),
)


@pytest.mark.parametrize(
    ("snapshot", "shown"),
    [
        (heard(None, Diagnosis(0, "/recorder", "not recording", NOW)), []),
        (heard(None, SMALL, GREAT), ["great", "small"]),
        (heard(None, OLD), []),  # its node is gone or well again
        (heard(received=NOW - 1.0), ["Silent since 12:00:00."]),
        (Snapshot(diagnoses={"/b": GREAT}), ["No ROS master answers."]),  # all else follows from it
    ],
)
def test_what_needs_attention_is_listed_worst_first(snapshot: Snapshot, shown: list[str]) -> None:
    """And nothing else."""
    assert [alarm.text for alarm in active_alarms(snapshot, NOW, 0.6)] == shown


@pytest.mark.parametrize(
    ("mode", "text"),
    [("FAULT", "the stream program does not start"), ("OFFLINE", "real: no answer")],
)
def test_alarm_of_the_controller_without_advice_gets_one(mode: str, text: str) -> None:
    """Text and what to do."""
    (alarm,) = active_alarms(heard(CellState(mode, alarm=text)), NOW, 0.6)
    assert alarm.text == text and alarm.remedy not in ("", ELSE)


def test_an_alarm_without_a_text_is_part_of_no_other() -> None:
    """A node that says only that something is wrong stays in the list beside one that says what."""
    silent, other = Diagnosis(2, "/a_node", "", NOW), Diagnosis(1, "/b_node", "is slow", NOW)
    shown = active_alarms(heard(None, silent, other), NOW, 0.6)
    assert [alarm.source for alarm in shown] == ["a_node", "b_node"]


def test_a_robot_that_wears_is_shown_with_what_it_means_now() -> None:
    """It works on; the text itself says where to look."""
    text = "joint_2 needs 18 % more torque; likely friction: look at its grease"
    (alarm,) = active_alarms(heard(None, Diagnosis(1, "/health_watch: wear", text, NOW)), NOW, 0.6)
    assert (alarm.level, alarm.text) == ("warn", text)
    assert alarm.remedy == "The text says where to look; the robot works on meanwhile."


def test_alarm_that_says_itself_what_to_do_gets_no_second_advice() -> None:
    """Once is enough."""
    text = "emergency stop is latched: remove the cause, RESET, then ALIGN"
    (alarm,) = active_alarms(heard(CellState("ESTOP", alarm=text)), NOW, 0.6)
    assert (alarm.level, alarm.text, alarm.remedy) == ("error", text, "")


def test_one_trouble_is_one_line_and_names_its_source() -> None:
    """The controller repeats the robot's alarm as its mode and as its own.

    The line that stays is the robot's.
    """
    alarm = "SRVO-001 emergency stop"
    snapshot = heard(
        CellState("FAULT", alarm=alarm),
        Diagnosis(2, "/twin_controller: mode", f"FAULT: {alarm}", NOW),
        Diagnosis(2, "/twin_controller: real robot", alarm, NOW),
    )
    (shown,) = active_alarms(snapshot, NOW, 0.6)
    assert shown.source == "real robot" and "pendant" in shown.remedy


@pytest.mark.parametrize(
    ("source", "text", "what"),
    [
        ("recorder", "recording ended: the disk is full", "room on the disk"),
        ("simulator: physics", "too slow: 0.70 of real time instead of 1", "overloaded"),
        ("simulator: physics", "joint_1 was at its effort limit in 4.1 % of", "lower speed"),
        ("twin_controller: link real", "no fresh data for 100 ms", "Modbus"),
        ("what_if: predictions", "moving time of the last 5 motions is +8.0 % off", "previews"),
        ("something new", "broken", ELSE),
    ],
)
def test_remedy_fits_the_source(source: str, text: str, what: str) -> None:
    """An unknown source has a remedy too."""
    assert what in remedy(source, text)
