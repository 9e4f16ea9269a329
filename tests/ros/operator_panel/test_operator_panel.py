"""The operator panel as a ROS node, without a browser.

Who is let in, what reaches the cell, what pages are told.
"""

from __future__ import annotations

import csv
import json
import re
import time
from itertools import count
from typing import Any

import pytest
from harness.page.stand_in import StandIn, in_control
from harness.processes import wait_until
from harness.ros import Ros
from harness.wires.operator_page import TOKEN, VARIABLE, Panel, heard
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection


@pytest.mark.parametrize(
    ("cookie", "operator"), [("right", True), ("operator_panel_{port}=wrong", False), ("", False)]
)
def test_only_the_right_cookie_makes_an_operator(panel: Panel, cookie: str, operator: bool) -> None:
    """Everybody else watches."""
    shown = panel.enter() if cookie == "right" else cookie.format(port=panel.port)
    assert panel.told(shown)["operator"] is operator


def test_page_shows_what_the_controller_says(operator: ClientConnection) -> None:
    """Numbers as they are rounded there, words as they are said there."""
    text = heard(operator, "frame")["text"]
    assert (text["joint_1.real"], text["joint_1.deviation"]) == ("12.34", "+0.04")
    assert text["why"] == "The positions are agreed"


def test_page_takes_control_with_its_persons_token_and_gives_signs_of_life(
    operator: ClientConnection, stand_in: StandIn
) -> None:
    """The twin controller keeps the rules; a held button is told to it before a joint moves."""
    seat = next(who for who, action, _ in reversed(stand_in.asked) if action == "TAKE")
    wait_until(lambda: stand_in.asked[-1] == (seat, "KEEP", False), 20.0, "a page that is at rest")
    rest = len(stand_in.asked)
    assert re.fullmatch(rf"operator \d+ {TOKEN}", seat)
    presses = count(1)

    def moves() -> bool:
        """Press anew: a press that a late machine let die counts no more."""
        hold = {"hold": next(presses), "joint": "joint_1", "direction": 1, "percent": 3}
        operator.send(json.dumps(hold))
        return (seat, "KEEP", True) in stand_in.asked[rest:]

    wait_until(moves, 20.0, "a sign that it moves", period=0.3)


def test_event_is_acknowledged_by_an_operator_and_not_by_who_only_watches(
    panel: Panel, operator: ClientConnection
) -> None:
    """The list is the same for all. What who only watches is refused is no event."""

    def events() -> list[dict[str, str]]:
        text = panel.get("/events.csv").read().decode()
        return list(csv.DictReader(text.splitlines()))

    wait_until(events, 10.0, "an event")
    with panel.live() as viewer:
        viewer.send('{"acknowledge": 0}')
        viewer.send('{"hold": 11, "joint": "joint_1", "direction": 1, "percent": 3}')
        # The answers come in the order of the packets.
        assert "only watches" in heard(viewer, "refused")["why"]
        assert {row["acknowledged_by"] for row in events()} == {""}
        assert not any(row["text"].startswith("Jog") for row in events())
    operator.send('{"acknowledge": 0}')
    wait_until(lambda: events()[0]["acknowledged_by"], 10.0, "the acknowledgement")
    assert re.fullmatch(r"operator \d+", events()[0]["acknowledged_by"])


@pytest.mark.parametrize("packet", ['{"command": "HOME"}', "nonsense"])
def test_unknown_packet_ends_the_connection_and_nothing_else(
    panel: Panel, operator: ClientConnection, packet: str
) -> None:
    """Moves are sent by the page's own buttons only; the next page works."""
    operator.send(packet)
    with pytest.raises(ConnectionClosed):
        for _ in range(2000):
            operator.recv(timeout=10.0)
    with panel.live() as live:
        assert heard(live, "frame")


def test_page_whose_line_broke_without_a_word_comes_back_as_itself(panel: Panel) -> None:
    """Its new connection replaces the old one, which may seem open for long."""
    page = panel.told(panel.enter())["page"]
    with panel.live(page=page) as old:
        assert heard(old, "frame")
        with panel.live(page=page) as new:
            with pytest.raises(ConnectionClosed):
                for _ in range(2000):
                    old.recv(timeout=10.0)
            new.send('{"stop": "STOP", "press": 1}')
            assert heard(new, "stopped")["success"]


def test_page_of_an_earlier_server_is_told_to_load_again(panel: Panel) -> None:
    """By the code that the browser knows."""
    with panel.live(page="unknown") as live, pytest.raises(ConnectionClosed, match="4404"):
        live.recv(timeout=10.0)


class HeldButton:
    """A jog button under a finger: a sign each 50 ms.

    A press ends for good when its signs stay away, as they do when this machine stands still. A
    person then presses again, and so does this: a press lasts for forty signs.
    """

    def __init__(self, live: ClientConnection, joint: str, direction: int) -> None:
        """Press nothing yet."""
        self._live = live
        self._joint, self._direction = joint, direction
        self._sent = 0
        self.press = 0

    def sign(self) -> None:
        """Send a sign and wait for the next one's time."""
        self.press = 7 + self._sent // 40
        self._sent += 1
        self.late_sign()
        time.sleep(0.05)

    def late_sign(self) -> None:
        """Send a sign of the press that was last."""
        sign = {"hold": self.press, "joint": self._joint, "direction": self._direction}
        self._live.send(json.dumps(sign | {"percent": 2}))


def test_jog_is_sent_while_signs_come_and_ends_with_a_zero(
    ros_module: Ros, operator: ClientConnection
) -> None:
    """Signs every 50 ms give commands; without them comes one zero, then silence."""
    from control_msgs.msg import JointJog

    jogs = ros_module.collect("joint_vel_controller/command", JointJog)
    button = HeldButton(operator, "joint_3", -1)

    def moves() -> list[tuple[tuple[str, ...], float]]:
        named = [(tuple(jog.joint_names), round(jog.velocities[0], 6)) for jog in jogs]
        return [(names, velocity) for names, velocity in named if velocity]

    def held() -> bool:
        button.sign()
        return len(moves()) >= 10

    wait_until(held, 20.0, "jog commands", period=0.0)
    assert set(moves()) == {(("joint_3",), -0.04)}
    wait_until(lambda: jogs[-1].velocities == (0.0,), 5.0, "the zero")
    count = len(jogs)
    button.late_sign()
    for _ in range(20):
        heard(operator, "frame")
    assert len(jogs) == count, "a late sign of the same press started the joint again"


def test_lost_page_stops_its_joint(ros_module: Ros, panel: Panel, stand_in: StandIn) -> None:
    """The connection is the hand."""
    from control_msgs.msg import JointJog

    jogs = ros_module.collect("joint_vel_controller/command", JointJog)
    with in_control(panel, stand_in) as live:
        button = HeldButton(live, "table_joint", 1)

        def held() -> bool:
            button.sign()
            return bool(jogs) and jogs[-1].velocities != (0.0,)

        wait_until(held, 20.0, "a jog command", period=0.0)
    wait_until(lambda: jogs[-1].velocities == (0.0,), 5.0, "the zero")


def test_page_that_vanished_without_a_word_keeps_no_control(
    panel: Panel, stand_in: StandIn
) -> None:
    """Its connection stays open, as when a network is gone; it reads nothing and says nothing."""
    with in_control(panel, stand_in, signs=False):

        def given_up() -> bool:
            told = len(stand_in.asked)
            time.sleep(1.0)  # five times the period of the signs of life
            return len(stand_in.asked) == told

        wait_until(given_up, 15.0, "the end of its signs of life", period=0.0)


def test_report_is_served_and_the_token_of_a_run_is_not(ros_module: Ros, panel: Panel) -> None:
    """A run's folder holds more than is for everybody."""
    run = ros_module.folder / "runs" / "one"
    (run / "ros_home").mkdir(parents=True, exist_ok=True)
    (run / "report.html").write_text("<p>report</p>")
    (run / "ros_home" / "operator_token").write_text("secret")
    assert panel.get("/runs/one/report.html").read() == b"<p>report</p>"
    for path in (
        "/runs/one/ros_home/operator_token",
        "/runs/one/ros_home%2Foperator_token",
        "/runs/one/..%2fone%2freport.html",
    ):
        assert panel.get(path).status == 404


@pytest.mark.parametrize(
    ("query", "status", "content"),
    [
        ("?time=-12.5", 200, {"stamp": -12.5}),
        ("?time=-300", 404, {"error": "is not remembered"}),
    ],
)
def test_pair_at_a_time_is_served_as_data(
    panel: Panel, query: str, status: int, content: dict[str, Any]
) -> None:
    """What the twin controller's memory answers, and why not where it does not."""
    answer = panel.get(f"/api/twin{query}")
    assert (answer.status, answer.getheader("Content-Type")) == (status, "application/json")
    found = json.loads(answer.read())
    assert {key: found[key] for key in content} == content


def test_silent_controller_is_said_with_the_time(
    operator: ClientConnection, stand_in: StandIn
) -> None:
    """The page greys itself out by this text.

    Last test with this controller, which stays silent.
    """
    stand_in.fall_silent()
    wait_until(
        lambda: "silent since" in heard(operator, "frame").get("silent", ""), 20.0, "the silence"
    )


def test_second_panel_of_a_name_says_so_and_leaves_the_first_alone(
    ros_module: Ros, panel: Panel
) -> None:
    """At a port of its own it would push the first one out of the master."""
    node = ros_module.run(
        "operator_panel",
        "operator_panel",
        f"_port:={ros_module.free_port()}",
        env={VARIABLE: TOKEN},
    )
    assert node.wait(30.0) == 1
    assert f"{ros_module.namespace}/operator_panel runs already" in node.output
    with panel.live() as live:
        assert heard(live, "frame")


def test_taken_port_is_said(ros_module: Ros, panel: Panel) -> None:
    """Not left to a log of the web server."""
    node = ros_module.run(
        "operator_panel", "operator_panel", f"_port:={panel.port}", env={VARIABLE: TOKEN}
    )
    assert node.wait(30.0) == 2
    assert f"127.0.0.1:{panel.port} cannot be listened on" in node.output
