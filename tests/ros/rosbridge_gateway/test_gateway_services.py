"""Services of real ROS nodes and of web-socket clients, also when they fail."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

import rospy
from harness.opponents.running_gateway import DEADLINE, RunningGateway
from std_srvs.srv import SetBool, SetBoolRequest, SetBoolResponse, Trigger, TriggerResponse


def offer(
    gateway: RunningGateway, name: str, kind: type[Any], handler: Callable[[Any], Any]
) -> rospy.Service:
    """Offer a service in the test's own process."""
    return rospy.Service(gateway.ros.name(name), kind, handler)


def test_failing_service_is_answered_with_its_reason(gateway: RunningGateway) -> None:
    """The text of the node's own error."""

    def fail(request: Any) -> Any:
        raise rospy.ServiceException("the drives are off")

    service = offer(gateway, "failing", Trigger, fail)
    answer = gateway.client().call("failing")
    assert answer["result"] is False and "the drives are off" in answer["values"]
    service.shutdown()
    answer = gateway.client().call("failing")
    assert (answer["result"], answer["values"]) == (
        False,
        f"service {gateway.ros.name('failing')} does not exist",
    )


def test_hanging_service_ends_at_the_calls_time_out(gateway: RunningGateway) -> None:
    """ROS itself has no time-out; the gateway has, and serves others meanwhile."""
    release = threading.Event()
    service = offer(
        gateway, "hanging", Trigger, lambda _: release.wait(DEADLINE) and TriggerResponse(True, "")
    )
    client = gateway.client()
    answer = client.call("hanging", timeout=0.3)
    assert (answer["result"], answer["values"]) == (
        False,
        f"service {gateway.ros.name('hanging')} did not answer within 0.3 s",
    )
    release.set()
    assert client.call("hanging")["values"] == {"success": True, "message": ""}
    service.shutdown()


def test_service_started_anew_with_another_type_is_found(gateway: RunningGateway) -> None:
    """The remembered type is asked for again after a failure."""
    service = offer(gateway, "changing", Trigger, lambda _: TriggerResponse(True, "old"))
    client = gateway.client()
    assert client.call("changing")["values"]["message"] == "old"
    service.shutdown()

    def answer(request: SetBoolRequest) -> SetBoolResponse:
        return SetBoolResponse(request.data, "new")

    service = offer(gateway, "changing", SetBool, answer)
    assert "md5sums do not match" in client.call("changing")["values"]
    assert client.call("changing", {"data": True})["values"] == {"success": True, "message": "new"}
    service.shutdown()


def test_client_that_is_silent_about_a_question_fails_the_ros_call(gateway: RunningGateway) -> None:
    """A ROS caller of a client's service gets the reason when the client goes."""
    client = gateway.client()
    client.say(op="advertise_service", service="mine", type="std_srvs/Trigger")
    mine = gateway.ros.service("mine", Trigger)
    outcome: list[str] = []

    def ask() -> None:
        try:
            mine()
        except rospy.ServiceException as error:
            outcome.append(str(error))

    caller = threading.Thread(target=ask)
    caller.start()
    assert client.hear("call_service")["service"] == "mine"
    client.line.close()
    caller.join(DEADLINE)
    assert len(outcome) == 1 and "the client that answers mine has gone" in outcome[0]
