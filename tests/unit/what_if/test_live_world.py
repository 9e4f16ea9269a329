"""What a running cell makes of the world: whom a sensor sees, and where the vehicle stands."""

from __future__ import annotations

import json
import math
import threading
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import pytest
import rospy
from geometry_msgs.msg import Point, PointStamped
from harness.processes import wait_until
from harness.yaml_files import copy_configuration
from scara_config.frames import TaughtFrame, save_frame
from sensor_msgs.msg import JointState
from std_msgs.msg import Header, String
from what_if.errors import WhatIfError
from what_if.geometry.sweep import Swept, sweep
from what_if.judging import judge
from what_if.live_world_node import JOINTS, MOTION, PEOPLE, PERSON_S, LiveWorld, live_world
from what_if.motions import JointTarget
from what_if.verdict import Outcome
from what_if.what_if_node import WhatIfServer
from what_if.world import World

from scara_msgs.msg import MotionState
from scara_msgs.srv import JudgeMotionRequest

NEAR, FAR = (0.5, 0.6, 0.0), (4.0, 0.0, 0.0)


class Topics:
    """The topics of a cell without a master."""

    def __init__(self, world: World, monkeypatch: pytest.MonkeyPatch) -> None:
        """Listen; nothing was heard but the joints."""
        monkeypatch.setattr(rospy, "Subscriber", Mock())
        self.live = LiveWorld(world, Mock())
        self.live.is_idle = lambda: False

    def sighting(self, sender: str, place: tuple[float, ...], frame: str = "base_link") -> None:
        """Let a sender say where somebody is."""
        message = PointStamped(header=Header(frame_id=frame), point=Point(*place))
        message._connection_header = {"callerid": sender}
        self.live._keep(message, PEOPLE)

    def world(self) -> World:
        """Return the world now; the joints are known."""
        self.live._keep(JointState(), JOINTS)
        world = self.live.now()
        assert world is not None
        return world

    def people(self) -> Any:
        """Return who is in the world now."""
        return self.world().people


@pytest.fixture
def topics(world: World, monkeypatch: pytest.MonkeyPatch) -> Topics:
    """Somebody beside the arm is seen by a sensor."""
    found = Topics(world, monkeypatch)
    found.sighting("/camera_a", NEAR)
    assert found.people() == (NEAR,)
    return found


@pytest.mark.parametrize(
    ("sender", "place", "frame"),
    [
        ("/camera_b", FAR, "base_link"),
        ("/camera_a", (math.nan, 0.6, 0.0), "base_link"),
        ("/camera_a", FAR, "cell_2/base_link"),
        ("/camera_a", FAR, ""),
    ],
)
def test_what_is_said_after_it_takes_nobody_away(
    topics: Topics, sender: str, place: tuple[float, ...], frame: str
) -> None:
    """Another sensor, a lost track, another cell's frame."""
    topics.sighting(sender, place, frame)
    assert NEAR in topics.people()
    assert all(map(math.isfinite, sum(topics.people(), ())))
    assert (FAR in topics.people()) is (sender == "/camera_b")


def test_a_sensor_says_where_its_person_went_and_forgets_after_a_while(
    topics: Topics, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its newest sighting counts, for so long."""
    topics.sighting("/camera_a", FAR)
    assert topics.people() == (FAR,)
    monkeypatch.setattr("what_if.live_world_node.PERSON_S", -PERSON_S)
    assert topics.people() == ()


def test_of_a_twin_that_is_gone_nothing_is_known(
    topics: Topics, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its last pose is not where the twin stands; a preview from there would be of another way."""
    monkeypatch.setattr("what_if.live_world_node.WAIT_S", -1.0)
    assert topics.live.now() is None


def test_a_move_is_judged_with_the_cap_in_force(
    world: World, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It stretches the whole plan, ramps too; a cap above that of the files raises nothing."""
    topics, lag = Topics(world, monkeypatch), world.lag.mean
    asked = JointTarget((1.0, 0.5, -0.1, 0.0), 50.0)
    takes = judge(world, asked).duration_s - lag
    for limit, outcome, stretch in ((20.0, Outcome.LIMITED, 2.5), (100.0, Outcome.OK, 1.0)):
        topics.live._keep(MotionState(speed_limit_percent=limit), MOTION)
        now = topics.world()
        assert now.cap_percent == min(limit, world.cap_percent)
        verdict = judge(now, asked)
        assert verdict.outcome is outcome
        assert verdict.duration_s == pytest.approx(stretch * takes + lag)


def test_joints_of_another_robot_make_no_world(topics: Topics) -> None:
    """Its pose would be judged with our bodies."""
    topics.live._keep(JointState(name=["joint_1", "joint_5"], position=[0.1, 0.2]), JOINTS)
    with pytest.raises(WhatIfError, match="has joint_5, which fanuc_sr6ia has not"):
        topics.live.now()


def test_another_robots_cell_is_not_judged_with_our_files(
    world: World, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two robots may name their joints alike: the cell tells which one it has."""
    for name in ("init_node", "Subscriber"):
        monkeypatch.setattr(rospy, name, Mock())
    monkeypatch.setattr("what_if.live_world_node.harden_process", Mock())
    monkeypatch.setattr("rosgraph.is_master_online", lambda: True)
    monkeypatch.setattr(LiveWorld, "wait", Mock())
    monkeypatch.setattr(LiveWorld, "now", lambda _: world)

    def told(name: str) -> String:
        return String(json.dumps({"robot.yaml": f"name: {name}\n"}))

    monkeypatch.setattr(rospy, "wait_for_message", lambda *_: told("fanuc_sr6ia"))
    assert live_world(world, Mock()) is world
    monkeypatch.setattr(rospy, "wait_for_message", lambda *_: told("epson_gx4"))
    with pytest.raises(WhatIfError, match="cell has epson_gx4, these files are of fanuc_sr6ia"):
        live_world(world, Mock())
    monkeypatch.setattr(rospy, "wait_for_message", Mock(side_effect=rospy.ROSException))
    assert live_world(world, Mock()) is world


@pytest.fixture
def server(topics: Topics, world: World, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    """A judge of a configuration of its own."""
    for name in ("Service", "Publisher", "logwarn_throttle"):
        monkeypatch.setattr(rospy, name, Mock())
    monkeypatch.setattr("what_if.live_world_node.PERSON_S", -PERSON_S)
    server = WhatIfServer(topics.live, world.cell, copy_configuration(tmp_path))
    server.learning = Mock()
    return server


def test_the_vehicle_is_judged_where_it_was_taught_last(
    server: Any, topics: Topics, tmp_path: Path
) -> None:
    """Taught anew, it is in the way or no longer; a wrong file leaves it where it stood."""

    def said() -> str:
        topics.people()  # the joints are known
        turn = JudgeMotionRequest(motion="MOVE_JOINTS", joint_positions=(1.4, 0.0, -0.05, 0.0))
        return str(server._answer(turn).message)

    def teach(height: float) -> None:
        save_frame(tmp_path, "user", 2, TaughtFrame("vehicle", (-50.0, 350.0, height)))

    assert said().startswith("OK")
    teach(150.0)
    assert "would hit vehicle" in said()
    (tmp_path / "frames.yaml").write_text("user: wrong\n")
    assert "would hit vehicle" in said()
    (tmp_path / "frames.yaml").unlink()
    assert said().startswith("OK")
    teach(150.0)
    assert "would hit vehicle" in said()
    teach(-40.0)
    assert said().startswith("OK")


def test_a_move_does_not_wait_for_a_preview(
    server: Any, topics: Topics, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Who only looks gives way between two legs; a question of the gate is answered to its end."""
    monkeypatch.setattr("what_if.live_world_node.WAIT_S", 60.0)  # however slow this machine is
    topics.people()
    answers: dict[bool, Any] = {}

    def ask(looks: bool) -> None:
        program = JudgeMotionRequest(motion="PROGRAM", program="PALLETISE", samples=2 * looks)
        answers[looks] = server._answer(program)

    threads = {looks: threading.Thread(target=ask, args=(looks,)) for looks in (True, False)}
    swept: list[object] = []

    def sweep_beside_a_move(*words: Any) -> Swept:
        if not swept:
            threads[False].start()
            wait_until(lambda: server._waiting, 10.0, "the move's question")
        swept.append(words)
        return sweep(*words)

    monkeypatch.setattr("what_if.judging.sweep", sweep_beside_a_move)
    threads[True].start()
    for thread in threads.values():
        thread.join(60.0)
    assert (answers[True].success, answers[True].message) == (
        False,
        "a move is judged first: ask again",
    )
    assert answers[False].verdict == "OK" and len(answers[False].placed) == 9
    ask(True)
    assert answers[True].verdict == "OK"
