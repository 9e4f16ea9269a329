"""Loops and listeners of a node without a goal: they wait, and are there when they are needed."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from itertools import pairwise

import pytest
import rospy
from scara_control.motion import idle_node as idle
from scara_control.motion.idle_node import Attention, IdleWait
from scara_control.motion.wiring_node import MotionClock

STILL, MOVING = (0.0, 0.0), (0.0, 0.5)
SLOW = (0.01, 0.01)
PROMPT_S = 30.0
"""Well under the 60 s that a wait would last: no machine is so slow."""


def in_thread(action: Callable[[], object]) -> threading.Thread:
    """Run ``action`` in a thread of its own."""
    thread = threading.Thread(target=action, daemon=True)
    thread.start()
    return thread


def test_a_busy_loop_does_not_wait() -> None:
    """It is told so, and keeps its own rhythm."""
    assert not IdleWait(lambda: False).wait(60.0)


def test_an_idle_loop_is_woken_at_once() -> None:
    """Not after its longest wait."""
    rest = IdleWait(lambda: True)
    waited: list[bool] = []
    begun = time.monotonic()
    thread = in_thread(lambda: waited.append(rest.wait(60.0)))
    while thread.is_alive():
        rest.wake()
    assert waited == [True] and time.monotonic() - begun < PROMPT_S


def test_what_begins_before_the_wait_is_not_slept_over() -> None:
    """Work that was begun and announced just before the wait is seen."""
    work: list[str] = []
    rest = IdleWait(lambda: not work)
    work.append("a goal")
    rest.wake()
    assert not rest.wait(60.0)


def test_an_idle_loop_looks_now_and_then() -> None:
    """It goes on by itself after its longest wait."""
    assert IdleWait(lambda: True).wait(0.001)


@pytest.fixture
def calm(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let attention end at once and holding last for ever."""
    monkeypatch.setattr(idle, "ATTENTION_S", 0.0)


@pytest.mark.usefixtures("calm")
@pytest.mark.parametrize(
    ("velocities", "is_idle"), [(MOVING, True), (STILL, False)], ids=["moving", "busy"]
)
def test_each_reading_is_taken_while_it_matters(
    velocities: tuple[float, ...], is_idle: bool
) -> None:
    """A twin that moves, and a node with a goal, are never read late."""
    begun = time.monotonic()
    Attention(lambda: is_idle, 60.0, SLOW).hold(velocities)
    assert time.monotonic() - begun < PROMPT_S


def test_each_reading_is_taken_after_a_start_and_after_rousing(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A motion elsewhere is seen from its first reading on, however slow it begins."""
    begun = time.monotonic()
    monkeypatch.setattr(idle, "ATTENTION_S", 0.0)
    roused = Attention(lambda: True, 60.0, SLOW)  # its first attention is over
    monkeypatch.setattr(idle, "ATTENTION_S", 60.0)
    roused.rouse()
    for attention in (Attention(lambda: True, 60.0, SLOW), roused):
        attention.hold(STILL)
    assert time.monotonic() - begun < PROMPT_S


@pytest.mark.usefixtures("calm")
def test_a_request_gets_the_newest_reading(monkeypatch: pytest.MonkeyPatch) -> None:
    """It ends the holding and waits until the reading after it has been taken."""
    monkeypatch.setattr(idle, "CATCH_UP_S", 60.0)
    attention = Attention(lambda: True, 60.0, SLOW)
    readings: list[int] = []

    def read() -> None:
        for number in range(2):
            readings.append(number)
            attention.hold(STILL)

    reader = in_thread(read)
    while not attention._holds:
        time.sleep(0.001)
    assert readings == [0]
    begun = time.monotonic()
    attention.catch_up()
    assert readings == [0, 1] and time.monotonic() - begun < PROMPT_S
    while reader.is_alive():
        attention.rouse()


@pytest.mark.usefixtures("calm")
def test_a_request_does_not_wait_where_all_is_read(monkeypatch: pytest.MonkeyPatch) -> None:
    """What is known then is the newest."""
    monkeypatch.setattr(idle, "CATCH_UP_S", 60.0)
    begun = time.monotonic()
    Attention(lambda: True, 60.0, SLOW).catch_up()
    assert time.monotonic() - begun < PROMPT_S


def test_a_request_goes_on_without_a_simulator(monkeypatch: pytest.MonkeyPatch) -> None:
    """No reading comes any more: it is judged by the age of the last one."""
    monkeypatch.setattr(idle, "ATTENTION_S", 0.0)
    monkeypatch.setattr(idle, "CATCH_UP_S", 0.001)
    attention = Attention(lambda: True, 60.0, SLOW)
    thread = in_thread(lambda: attention.hold(STILL))
    while not attention._holds:
        time.sleep(0.001)
    attention.catch_up()
    thread.join(10.0)
    assert not thread.is_alive()


@pytest.mark.parametrize("idle_s", [0.05, 0.1])
def test_a_clock_at_rest_ticks_each_idle_time_on_the_grid(
    monkeypatch: pytest.MonkeyPatch, idle_s: float
) -> None:
    """It still notices that its node stood still; its deadlines stay those of the loop."""
    ticks: list[float] = []
    clock = MotionClock.__new__(MotionClock)  # a clock asks the master whether time is simulated
    clock.simulated = False
    monkeypatch.setattr(rospy, "is_shutdown", lambda: len(ticks) >= 5)
    begun = time.monotonic()
    clock.run(0.01, ticks.append, IdleWait(lambda: True), idle_s)
    lasted = time.monotonic() - begun
    assert len(ticks) == 5 and lasted >= 4.0 * idle_s
    steps = [(later - tick) / 0.01 for tick, later in pairwise(ticks)]
    assert all(step == pytest.approx(round(step), abs=1e-6) for step in steps)
