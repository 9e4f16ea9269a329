"""What roslibpy's documentation shows, by roslibpy alone: run by the Python of its own venv.

Usage: roslibpy_examples.py PORT NAMESPACE. Prints one line of JSON for each check, see
../checks.py. The test's own nodes are below NAMESPACE: see harness/clients/ros_side.py.
"""

from __future__ import annotations

import sys
import threading
import time
from importlib.metadata import version
from typing import Any

import checks
import roslibpy

try:
    from roslibpy.ros1 import actionlib
except ModuleNotFoundError:  # roslibpy 1
    from roslibpy import actionlib

DEADLINE = 10.0


class Heard:
    """The messages of a topic."""

    def __init__(self, ros: roslibpy.Ros, name: str, kind: str, **options: Any) -> None:
        self.messages: list[Any] = []
        self._some = threading.Event()
        self.topic = roslibpy.Topic(ros, name, kind, **options)
        self.topic.subscribe(self._take)

    def _take(self, message: Any) -> None:
        self.messages.append(message)
        self._some.set()

    def first(self) -> Any:
        """Return the first message."""
        assert self._some.wait(DEADLINE), "no message came"
        self.topic.unsubscribe()
        return self.messages[0]


class Examples:
    """The checks: each method whose name begins with ``check_`` is one, in this order."""

    def __init__(self, ros: roslibpy.Ros, namespace: str) -> None:
        self._ros = ros
        self._namespace = namespace

    def _name(self, relative: str) -> str:
        return f"{self._namespace}/{relative}"

    def _service(self, relative: str) -> roslibpy.Service:
        return roslibpy.Service(self._ros, self._name(relative), "std_srvs/SetBool")

    def _told(self, relative: str, text: str) -> roslibpy.Topic:
        topic = roslibpy.Topic(self._ros, self._name(relative), "std_msgs/String")
        topic.publish(roslibpy.Message({"data": text}))
        return topic

    def check_connect(self) -> None:
        """Connected."""
        assert self._ros.is_connected

    def check_listen_to_a_topic(self) -> None:
        """A joint state has its names."""
        heard = Heard(self._ros, self._name("states"), "sensor_msgs/JointState").first()
        assert heard["name"] == ["joint_1"], heard

    def check_publish_right_after_advertise(self) -> None:
        """Nobody has waited for a subscriber to connect."""
        answers = Heard(self._ros, self._name("answer"), "std_msgs/String")
        self._ros.get_time()  # the subscription is made
        question = self._told("question", "hello")
        assert answers.first()["data"] == "hello"
        question.unadvertise()

    def check_header_without_a_stamp(self) -> None:
        """It gets the present time."""
        stamps = Heard(self._ros, self._name("stamped"), "std_msgs/Header")
        self._ros.get_time()
        topic = roslibpy.Topic(self._ros, self._name("stamped"), "std_msgs/Header")
        topic.publish(roslibpy.Message({"frame_id": "base_link"}))
        stamp = stamps.first()["stamp"]
        now = self._ros.get_time()
        assert abs(stamp["secs"] - now["secs"]) <= 5, (stamp, dict(now))
        topic.unadvertise()

    def check_call_a_service(self) -> None:
        """It answers with its fields."""
        answer = self._service("switch").call(roslibpy.ServiceRequest({"data": True}), timeout=10)
        assert dict(answer) == {"success": True, "message": "on"}, dict(answer)

    def _lamp(self, returned: bool, expected: str) -> None:
        def answer(request: Any, response: Any) -> bool:
            response["success"], response["message"] = request["data"], "lit"
            return returned

        service = self._service("lamp")
        service.advertise(answer)
        used = f"lamp_used_{returned}"
        outcomes = Heard(self._ros, self._name(used), "std_msgs/String")
        self._ros.get_time()
        topic = self._told("use_lamp", used)
        outcome = outcomes.first()["data"]
        topic.unadvertise()
        service.unadvertise()
        self._ros.get_time()
        assert outcome == expected, outcome

    def check_offer_a_service(self) -> None:
        """A ROS node calls it."""
        self._lamp(True, "True lit")

    def check_offer_a_service_whose_handler_returns_false(self) -> None:
        """The values arrive all the same."""
        self._lamp(False, "True lit")

    def check_parameters(self) -> None:
        """Set, read and delete."""
        name = self._name("gains")
        parameter = roslibpy.Param(self._ros, name)
        parameter.set({"p": 1.5, "joints": ["joint_1"]})
        assert parameter.get() == {"p": 1.5, "joints": ["joint_1"]}
        assert name + "/p" in self._ros.get_params()
        parameter.delete()
        assert parameter.get() is None

    def check_questions_about_topics(self) -> None:
        """Names and types, both ways."""
        states = self._name("states")
        assert states in self._ros.get_topics()
        assert self._ros.get_topic_type(states) == "sensor_msgs/JointState"
        assert states in self._ros.get_topics_for_type("sensor_msgs/JointState")

    def check_questions_about_services(self) -> None:
        """Names and types, both ways."""
        switch = self._name("switch")
        assert switch in self._ros.get_services()
        assert self._ros.get_service_type(switch) == "std_srvs/SetBool"
        assert switch in self._ros.get_services_for_type("std_srvs/SetBool")

    def check_questions_about_nodes(self) -> None:
        """Somebody publishes the states."""
        found = [self._ros.get_node_details(node) for node in self._ros.get_nodes()]
        assert any(self._name("states") in node["publishing"] for node in found), found

    def check_questions_about_types(self) -> None:
        """Fields of a message, of a request and of a response."""
        fields = self._ros.get_message_details("sensor_msgs/JointState")["typedefs"]
        assert fields[0]["fieldnames"][0] == "header", fields
        request = self._ros.get_service_request_details("std_srvs/SetBool")["typedefs"]
        response = self._ros.get_service_response_details("std_srvs/SetBool")["typedefs"]
        assert request[0]["fieldnames"] == ["data"], request
        assert response[0]["fieldnames"] == ["success", "message"], response

    def check_action_servers(self) -> None:
        """An answer comes, by callback."""
        answers: list[Any] = []
        done = threading.Event()

        def take(answer: Any) -> None:
            answers.append(answer)
            done.set()

        self._ros.get_action_servers(take)
        assert done.wait(DEADLINE) and "action_servers" in answers[0], answers

    def check_send_an_action_goal(self) -> None:
        """Feedback while it is done, and the result."""
        client = actionlib.ActionClient(self._ros, self._name("count"), "actionlib/TestAction")
        feedback: list[Any] = []
        goal = actionlib.Goal(client, roslibpy.Message({"goal": 3}))
        goal.on("feedback", feedback.append)
        goal.send()
        result = goal.wait(10)
        client.dispose()
        assert result == {"result": 3} and feedback, (result, feedback)

    def check_refused_call_raises(self) -> None:
        """With the reason."""
        try:
            self._service("nowhere").call(roslibpy.ServiceRequest({"data": True}), timeout=10)
        except Exception as error:
            assert "nowhere" in str(error), error
        else:
            raise AssertionError("no error was raised")

    def check_think_between_two_calls(self) -> None:
        """Longer than a connection that drives may be silent."""
        self._ros.get_time()
        time.sleep(1.5)
        self._ros.get_time()


def main() -> None:
    """Run all checks."""
    ros = roslibpy.Ros(host="127.0.0.1", port=int(sys.argv[1]))
    ros.run(timeout=DEADLINE)
    examples = Examples(ros, sys.argv[2])
    checks.run(
        "roslibpy", version("roslibpy"), {name: getattr(examples, name) for name in vars(Examples)}
    )
    ros.terminate()


if __name__ == "__main__":
    main()
