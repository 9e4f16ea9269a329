"""What a client publishes right after its advertise, between real ROS nodes and real clients."""

from __future__ import annotations

import sys
import threading
import time

import actionlib
import pytest
import rospy
from actionlib.msg import TestAction, TestActionGoal, TestFeedback, TestGoal, TestResult
from harness.opponents.running_gateway import DEADLINE, RunningGateway
from harness.ros import Ros
from harness.running.thorough import examples
from harness.wires.gateway_client import RosbridgeClient
from std_msgs.msg import String

from scara_msgs.msg import MotionCommand

SHORTEST_SCRIPT = """
import sys
import roslibpy

client = roslibpy.Ros(host="127.0.0.1", port=int(sys.argv[1]))
client.run()
talker = roslibpy.Topic(client, sys.argv[2] + "/chatter", "std_msgs/String")
talker.publish(roslibpy.Message({"data": "Hello World!"}))
talker.unadvertise()
client.get_time()  # roslibpy sends in a thread of its own, and terminate() does not wait for it
client.terminate()
"""


def advertise_and_publish(client: RosbridgeClient, topic: str, *texts: str, **more: object) -> None:
    """Say it without waiting for anything."""
    client.say(op="advertise", topic=topic, type="std_msgs/String", **more)
    for text in texts:
        client.say(op="publish", topic=topic, msg={"data": text})


@pytest.mark.parametrize("latch", [False, True])
def test_what_is_published_right_after_advertise_arrives_once_and_in_order(
    gateway: RunningGateway, latch: bool
) -> None:
    """Four topics, each with a subscriber that has been waiting."""
    ros = gateway.ros
    topics = [f"first_{latch}_{number}" for number in range(4)]
    heard = [ros.collect(topic, String) for topic in topics]
    client = gateway.client()
    texts = [str(number) for number in range(5)]
    for topic in topics:
        advertise_and_publish(client, topic, *texts, latch=latch)
    ros.wait_until(lambda: all(len(h) >= 5 for h in heard), DEADLINE, "all messages")
    for topic in topics:
        client.say(op="publish", topic=topic, msg={"data": "last"})
    ros.wait_until(lambda: all(h[-1].data == "last" for h in heard), DEADLINE, "the last")
    said = [[m.data for m in h] for h in heard]
    # Of a latching topic the newest comes twice, as with rosbridge_server.
    assert [list(dict.fromkeys(words)) for words in said] == [[*texts, "last"]] * 4
    assert all(len(words) <= 6 + latch for words in said)


def test_subscriber_that_comes_within_the_second_gets_all_of_it(gateway: RunningGateway) -> None:
    """One that comes later gets nothing old."""
    ros, client = gateway.ros, gateway.client()
    advertise_and_publish(client, "second", "a", "b")
    begun = time.monotonic()
    heard = ros.collect("second", String)
    ros.wait_until(lambda: len(heard) == 2, DEADLINE, "what was published before")
    threading.Event().wait(max(0.0, begun + 2.1 - time.monotonic()))
    late = ros.collect("second", String)
    ros.wait_until(
        lambda: client.say(op="publish", topic="second", msg={"data": "new"}) or late, DEADLINE
    )
    assert late[0].data == "new" and [m.data for m in heard[:3]] == ["a", "b", "new"]


def test_shortest_script_of_roslibpys_documentation_reaches_its_listener(
    gateway: RunningGateway,
) -> None:
    """It publishes, unadvertises and ends; ten times out of ten."""
    ros = gateway.ros
    heard = ros.collect("chatter", String)
    script = ros.folder / "talker.py"
    script.write_text(SHORTEST_SCRIPT, encoding="utf-8")
    talkers = [
        ros.stage.start(sys.executable, str(script), str(gateway.port), ros.namespace)
        for _ in range(3)
    ]
    assert [talker.wait(20.0) for talker in talkers] == [0, 0, 0]
    for _ in range(7):
        client = gateway.client()
        advertise_and_publish(client, "chatter", "Hello World!")
        client.line.close()
    ros.wait_until(lambda: len(heard) >= 10, DEADLINE, "ten messages")
    ros.wait_until(
        lambda: not any("gateway" in name for name in publishers(ros, "chatter")),
        DEADLINE,
        "the end of the publisher that has stayed for late subscribers",
    )
    assert [message.data for message in heard] == ["Hello World!"] * 10


def publishers(ros: Ros, topic: str) -> list[str]:
    """Return the nodes that publish ``topic``."""
    found, _, _ = rospy.get_master().getSystemState()[2]
    return list(dict(found).get(ros.name(topic), []))


def test_command_is_never_delivered_late_and_its_sender_is_told(gateway: RunningGateway) -> None:
    """A RESUME that nobody could hear yet is said to have reached nobody, once."""
    ros, client = gateway.ros, gateway.client()
    client.say(op="advertise", topic="motion_command", type="scara_msgs/MotionCommand")
    for number in (1, 2):
        client.say(op="publish", topic="motion_command", msg={"command": 3, "id": number})
    told = client.hear("status")
    assert told["level"] == "error"
    assert "motion_command: nobody was connected yet, so this reached nobody" in told["msg"]
    heard = ros.collect("motion_command", MotionCommand)
    now = {"op": "publish", "topic": "motion_command", "msg": {"command": 3, "id": 3}}
    ros.wait_until(lambda: client.say(**now) or heard, DEADLINE)
    assert {message.id for message in heard} == {3}
    assert all(message.asked for message in heard), "when its packet came"


ACTION_SCRIPT = """
import sys
import roslibpy
from roslibpy.ros1 import actionlib

client = roslibpy.Ros(host="127.0.0.1", port=int(sys.argv[1]))
client.run()
action = actionlib.ActionClient(client, sys.argv[2], "actionlib/TestAction")
goal = actionlib.Goal(action, roslibpy.Message({"goal": 8}))
goal.send()
result = goal.wait(10)
action.dispose()
print("result", result["result"])
client.terminate()
"""


def test_action_client_of_roslibpy_gets_its_result(gateway: RunningGateway) -> None:
    """The steps of its documentation: a goal right behind the advertise; each time."""
    ros = gateway.ros

    def count(goal: TestGoal) -> None:
        """Work for half a second, as any action that is worth one: feedback, then the result."""
        for step in range(5):
            server.publish_feedback(TestFeedback(step))
            rospy.rostime.wallsleep(0.1)
        server.set_succeeded(TestResult(2 * goal.goal))

    server = actionlib.SimpleActionServer(ros.name("double"), TestAction, count, auto_start=False)
    server.start()
    script = ros.folder / "act.py"
    script.write_text(ACTION_SCRIPT, encoding="utf-8")
    for _ in range(examples(2, 6)):
        client = ros.stage.start(sys.executable, str(script), str(gateway.port), ros.name("double"))
        assert client.wait(30.0) == 0, client.tail()
        assert "result 16" in client.output


def test_goal_is_forgotten_at_a_stop(gateway: RunningGateway) -> None:
    """Its server connects after the STOP and gets nothing; its sender is told, and sends again."""
    ros, client = gateway.ros, gateway.client()
    commands = ros.publisher("motion_command", MotionCommand)
    ros.wait_until(commands.get_num_connections, DEADLINE, "the gateway hears stops")
    goal = {"op": "publish", "topic": "reach/goal", "msg": {"goal": {"goal": 1}}}
    client.say(op="advertise", topic="reach/goal", type="actionlib/TestActionGoal")
    client.say(**goal)
    client.call("/rosapi/get_time")
    commands.publish(MotionCommand(command=MotionCommand.STOP, asked=time.monotonic()))
    told = client.hear("status")
    assert told["msg"].endswith("reach/goal: cancelled by STOP, before it began: send it again")
    heard = ros.collect("reach/goal", TestActionGoal)
    goal["msg"] = {"goal": {"goal": 2}}
    ros.wait_until(lambda: client.say(**goal) or heard, DEADLINE, "a goal after the STOP")
    assert {message.goal.goal for message in heard} == {2}
    assert all(message.header.stamp for message in heard), "when its packet came"
