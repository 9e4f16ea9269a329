"""A joint moves only while signs of a held button keep coming."""

from __future__ import annotations

import pytest
from harness.workspace import ROOT
from hypothesis import given
from hypothesis import strategies as st
from operator_panel.control.jog import DeadMan, JogError
from scara_config import load_robot

ROBOT = load_robot(ROOT / "config")
SPEED = ROBOT.joint("joint_1").velocity * 0.03


@pytest.fixture
def dead_man() -> DeadMan:
    """Give a rule with a time-out of 0.25 s and at most 10 %."""
    return DeadMan(ROBOT, 10.0, 0.25)


def test_held_button_moves_its_joint_at_its_share_of_the_speed(dead_man: DeadMan) -> None:
    """3 % of joint_1, downwards."""
    dead_man.hold("a", 1, "joint_1", -1, 3.0, 0.0)
    assert dead_man.tick(0.05) == {"joint_1": pytest.approx(-SPEED)}


def test_release_gives_one_zero_then_silence(dead_man: DeadMan) -> None:
    """The explicit zero stops now, silence would stop later."""
    dead_man.hold("a", 1, "joint_1", 1, 3.0, 0.0)
    dead_man.release("a", 1)
    assert dead_man.tick(0.01) == {"joint_1": 0.0}
    assert dead_man.tick(0.06) == {}


def test_lost_signs_stop_the_joint(dead_man: DeadMan) -> None:
    """The page, its pointer or its line may be gone: nobody says so."""
    dead_man.hold("a", 1, "joint_1", 1, 3.0, 0.0)
    assert dead_man.tick(0.25) == {"joint_1": pytest.approx(SPEED)}
    assert dead_man.tick(0.26) == {"joint_1": 0.0}
    assert dead_man.tick(0.30) == {}


def test_late_sign_of_a_released_press_starts_nothing(dead_man: DeadMan) -> None:
    """Packets may overtake each other."""
    dead_man.hold("a", 5, "joint_1", 1, 3.0, 0.0)
    dead_man.release("a", 5)
    dead_man.tick(0.0)
    for press in (5, 4):
        dead_man.hold("a", press, "joint_1", 1, 3.0, 0.1)
        assert dead_man.tick(0.1) == {}


def test_late_sign_after_the_time_out_starts_nothing(dead_man: DeadMan) -> None:
    """After a pause in the line the button has to be pressed anew."""
    dead_man.hold("a", 1, "joint_1", 1, 3.0, 0.0)
    dead_man.tick(1.0)
    dead_man.hold("a", 1, "joint_1", 1, 3.0, 1.1)
    assert dead_man.tick(1.1) == {}


def test_new_press_of_another_joint_stops_the_first(dead_man: DeadMan) -> None:
    """One joint at a time."""
    dead_man.hold("a", 1, "joint_1", 1, 3.0, 0.0)
    dead_man.hold("a", 2, "joint_2", 1, 3.0, 0.01)
    assert dead_man.tick(0.02) == {
        "joint_1": 0.0,
        "joint_2": pytest.approx(ROBOT.joint("joint_2").velocity * 0.03),
    }


def test_another_page_cannot_take_over_a_held_button(dead_man: DeadMan) -> None:
    """Nor release it."""
    dead_man.hold("a", 1, "joint_1", 1, 3.0, 0.0)
    with pytest.raises(JogError, match="another page"):
        dead_man.hold("b", 9, "joint_1", -1, 3.0, 0.1)
    dead_man.release("b", 9)
    assert dead_man.tick(0.1) == {"joint_1": pytest.approx(SPEED)}


def test_page_that_leaves_stops_what_it_holds(dead_man: DeadMan) -> None:
    """A closed tab is a released button."""
    dead_man.hold("a", 1, "joint_3", 1, 3.0, 0.0)
    dead_man.forget("a")
    assert dead_man.tick(0.0) == {"joint_3": 0.0}
    assert dead_man.page == ""


@pytest.mark.parametrize(
    ("joint", "direction", "percent", "why"),
    [
        ("joint_4", 1, 3.0, "unknown joint 'joint_4': there are joint_1"),
        ("joint_1", 0, 3.0, "direction = 0"),
        ("joint_1", 1, 0.0, "speed = 0 % is outside 0 to 10 %"),
        ("joint_1", 1, 10.1, "speed = 10.1 % is outside"),
        ("joint_1", 1, float("nan"), "speed = nan"),
    ],
)
def test_wrong_press_is_refused(
    dead_man: DeadMan, joint: str, direction: int, percent: float, why: str
) -> None:
    """What comes from a browser is not trusted."""
    with pytest.raises(JogError, match=why):
        dead_man.hold("a", 1, joint, direction, percent, 0.0)
    assert dead_man.tick(0.0) == {}


@given(
    st.lists(
        st.tuples(st.sampled_from(["hold", "release", "wait"]), st.integers(1, 4)), max_size=40
    )
)
def test_nothing_moves_once_all_is_quiet(steps: list[tuple[str, int]]) -> None:
    """Whatever came before: after the time-out and its zero there is silence."""
    dead_man, now = DeadMan(ROBOT, 10.0, 0.25), 0.0
    for what, press in steps:
        now += 0.05
        if what == "hold":
            dead_man.hold("a", press, "joint_1", 1, 3.0, now)
        elif what == "release":
            dead_man.release("a", press)
        dead_man.tick(now)
    assert set(dead_man.tick(now + 0.3).values()) <= {0.0}
    assert dead_man.tick(now + 0.35) == {}
