"""The whole cell does what it is for, seen only through the tools that a user has."""

from __future__ import annotations

import math
import xmlrpc.client
from typing import Any

import pytest
from harness.live_cell import LiveCell, forward
from harness.processes import wait_until
from harness.running.thorough import thorough

pytestmark = pytest.mark.system

REACH = 0.65
TOLERANCE = 0.002 * REACH
POSITIONS = {"P2": (0.51, 0.16, 0.10), "P3": (0.51, -0.16, 0.16), "P1": (0.65, 0.0, 0.0)}


def distance(a: tuple[float, float, float], b: tuple[float, float, float]) -> float:
    """Return the distance of two points."""
    return math.dist(a, b)


def test_cell_starts_at_home_and_mbpoll_reads_the_joints_of_the_robot(live_cell: LiveCell) -> None:
    """A Modbus client that shares no code with the project reads POS[0] as float32 in deg and mm.

    Position 1.
    """
    joints = live_cell.real_joints()
    assert len(joints) == 9
    assert joints == pytest.approx([0.0, 0.0, -160.0, 0, 0, 0, 0, 0, 0], abs=0.02)


@pytest.mark.parametrize("name", ["P2", *thorough("P3", "P1")])
def test_move_to_moves_the_twin_there_and_the_robot_follows(live_cell: LiveCell, name: str) -> None:
    """`rosservice call /move_to` brings both to the article's positions, within 0.2 % of reach."""

    def scene() -> None:
        x, y, z = POSITIONS[name]
        answer = live_cell.tool_call("/move_to", f"{{x: {x}, y: {y}, z: {z}}}")
        assert answer["success"], answer
        q1, q2, q3 = answer["joint_positions"][:3]
        assert (
            distance(forward([math.degrees(q1), math.degrees(q2), q3 * 1000.0]), (x, y, z))
            < TOLERANCE
        )
        assert answer["error"] < TOLERANCE
        wait_until(
            lambda: distance(live_cell.real_tool(), (x, y, z)) < TOLERANCE,
            10.0,
            f"the robot at {name}",
            period=0.1,
        )
        wait_until(lambda: live_cell.mode() == "IDLE", 10.0, "mode IDLE", period=0.1)

    live_cell.beside_lost_links(scene)


def test_move_to_out_of_reach_is_refused_with_a_reason(live_cell: LiveCell) -> None:
    """Nothing moves, and the text names the reach."""
    before = live_cell.real_joints()
    answer = live_cell.tool_call("/move_to", "{x: 0.9, y: 0, z: 0}")
    assert answer["success"] is False
    assert "0.65" in answer["message"] and "0.9" in answer["message"]
    assert live_cell.real_joints() == pytest.approx(before, abs=0.02)


def test_stop_of_the_operator_stops_both_sides(live_cell: LiveCell) -> None:
    """A running move is aborted with a text, both stand, and a new command leads out of it.

    From position 1 joint 2 turns by 126 deg, which takes 18 s at 1 %: time for a tool that is
    started on a busy machine.
    """

    def scene() -> None:
        assert live_cell.call("/move_to", "{x: 0.65, y: 0.0, z: 0.0}")["success"]
        wait_until(lambda: live_cell.mode() == "IDLE", 10.0, "mode IDLE", period=0.1)
        x, y, z = 0.30, 0.0, 0.0
        move = live_cell.stage.start(
            "rosservice", "call", "/move_to", f"{{x: {x}, y: {y}, z: {z}, speed_percent: 1}}"
        )
        wait_until(lambda: live_cell.mode() == "TWIN_LEADS", 15.0, "TWIN_LEADS", period=0.05)
        assert live_cell.call("/twin_controller/command", "{command: STOP}")["success"]
        move.wait(20.0)
        assert "success: False" in move.output and "STOP" in move.output.upper()
        wait_until(lambda: live_cell.mode() in ("STOPPED", "IDLE"), 10.0, "standstill", period=0.1)
        first = live_cell.real_joints()
        assert distance(forward(first), (x, y, z)) > 10 * TOLERANCE, "it stood before the target"
        assert live_cell.real_joints() == pytest.approx(first, abs=0.02)
        refused = live_cell.call("/move_to", "{x: 0.65, y: 0.0, z: 0.0}")
        assert not refused["success"] and "ALIGN, then it may lead" in refused["message"], refused
        assert live_cell.real_joints() == pytest.approx(first, abs=0.02)
        assert live_cell.call("/twin_controller/command", "{command: ALIGN}")["success"]
        wait_until(lambda: live_cell.mode() == "IDLE", 20.0, "IDLE", period=0.1)
        home = live_cell.call("/move_to", "{x: 0.65, y: 0.0, z: 0.0}")
        assert home["success"], home
        wait_until(
            lambda: distance(live_cell.real_tool(), (0.65, 0.0, 0.0)) < TOLERANCE,
            10.0,
            "home again",
            period=0.1,
        )

    live_cell.beside_lost_links(scene)


def test_whoever_moves_the_twin_of_a_stopped_pair_is_named(live_cell: LiveCell) -> None:
    """A program that has never heard of the STOP stands in the audit by its node's name."""
    topic = "/twin/joint_1_velocity_controller/command"

    def hears() -> bool:
        master: Any = xmlrpc.client.ServerProxy(live_cell.master_uri)
        subscribers = dict(master.getSystemState("/tests")[2][1])
        return any("rostopic" in node for node in subscribers.get("/twin_controller/audit", ()))

    def scene() -> None:
        assert live_cell.call("/twin_controller/command", "{command: STOP}")["success"]
        audit = live_cell.stage.start("rostopic", "echo", "/twin_controller/audit")
        # It is said once.
        wait_until(hears, 20.0, "who hears the audit", period=0.1)
        mover = live_cell.stage.start(
            "rostopic", "pub", "-r", "2", topic, "std_msgs/Float64", "0.1", "__name:=forgotten"
        )
        begun = live_cell.real_joints()
        wait_until(lambda: 'who: "/forgotten"' in audit.output, 20.0, "its name", period=0.1)
        assert topic.removeprefix("/") in audit.output
        assert live_cell.mode() == "STOPPED"
        assert live_cell.real_joints() == pytest.approx(begun, abs=0.02)
        mover.stop()
        audit.stop()
        assert audit.output.count('who: "/forgotten"') == 1, "once in a stop"

    live_cell.beside_lost_links(scene)


def test_commands_without_words_pause_resume_stop_and_reset(live_cell: LiveCell) -> None:
    """std_srvs/Trigger, for buttons and scripts: `rosservice call /twin_controller/pause`."""

    def trigger(command: str, mode: str) -> None:
        answer = live_cell.call(f"/twin_controller/{command}")
        assert answer["success"], (command, answer)
        wait_until(lambda: live_cell.mode() == mode, 15.0, f"{mode} after {command}", period=0.05)

    def scene() -> None:
        assert live_cell.call("/move_to", "{x: 0.65, y: 0.0, z: 0.0}")["success"]
        wait_until(lambda: live_cell.mode() == "IDLE", 10.0, "mode IDLE", period=0.1)
        move = live_cell.stage.start(
            *("rosservice", "call", "/move_to"), "{x: 0.3, y: 0.0, z: 0.0, speed_percent: 1}"
        )
        wait_until(lambda: live_cell.mode() == "TWIN_LEADS", 15.0, "TWIN_LEADS", period=0.05)
        trigger("pause", "PAUSED")
        assert move.poll() is None, "the goal is kept"
        trigger("resume", "TWIN_LEADS")
        trigger("stop", "STOPPED")
        assert move.wait(20.0) == 0 and "success: False" in move.output
        assert live_cell.call("/twin_controller/command", "{command: ESTOP}")["success"]
        wait_until(lambda: live_cell.mode() == "ESTOP", 10.0, "ESTOP", period=0.05)
        assert not live_cell.call("/twin_controller/resume")["success"], "only RESET leads on"
        assert live_cell.tool_call("/twin_controller/reset")["success"]
        wait_until(lambda: live_cell.mode() == "STOPPED", 15.0, "STOPPED", period=0.05)

    live_cell.beside_lost_links(scene)
