"""A stand-in for the twin controller, for tests of the operator panel as a ROS node."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterator
from typing import Any

from websockets.sync.client import ClientConnection

from harness.page.pair import shadow_document
from harness.processes import wait_until
from harness.ros import Ros
from harness.wires.operator_page import Panel


class StandIn:
    """The twin controller, as far as the panel knows it."""

    def __init__(self, ros: Ros) -> None:
        """Offer the service and publish a state 20 times a second."""
        import rospy
        from geometry_msgs.msg import Point

        from scara_msgs.msg import TwinControllerState
        from scara_msgs.srv import (
            Control,
            ControlResponse,
            Shadow,
            ShadowResponse,
            TwinCommand,
            TwinCommandResponse,
        )

        self.commands: list[tuple[str, float]] = []
        self.asked: list[tuple[str, str, bool]] = []
        """Seat, token and action, and whether the seat moves the twin."""

        def obey(request: Any) -> TwinCommandResponse:
            self.commands.append((request.command, request.speed_percent))
            heard = request.command != "HOME"
            return TwinCommandResponse(heard, f"{request.command} was heard", heard)

        def hand_out(request: Any) -> ControlResponse:
            """Give control to whoever takes it last, as if the others were gone."""
            seat = f"{request.person} {request.session}"
            self.asked.append((f"{seat} {request.token}", request.action, request.moves))
            if request.action == "TAKE":
                self.state.holder = seat
            return ControlResponse(True, "", self.state.holder)

        self.state = TwinControllerState(mode="IDLE", why="the positions are agreed")
        self.state.command = ["HOME", "ALIGN", "MOVE", "SPEED", "JOG", "RUN"]
        self.state.refused = [""] * len(self.state.command)
        self.state.name, self.state.unit = (
            ["joint_1", "joint_2", "joint_3", "table_joint"],
            ["deg", "deg", "mm", "deg"],
        )
        self.state.real_position, self.state.twin_position = [12.34, 0, -160, 0], [12.3, 0, -160, 0]
        self.state.deviation = [0.04, 0, 0, 0]
        self.state.real_tool = self.state.twin_tool = Point(math.nan, math.nan, math.nan)
        self.state.not_in_control = "nobody holds control: take control first"
        self._service = rospy.Service(ros.name("twin_controller/command"), TwinCommand, obey)
        self._control = rospy.Service(ros.name("twin_controller/control"), Control, hand_out)

        def remember(request: Any) -> ShadowResponse:
            known = request.time > -60.0
            return ShadowResponse(
                known,
                "" if known else "is not remembered",
                shadow_document(request.time) if known else "",
            )

        self._memory = rospy.Service(ros.name("twin_controller/shadow"), Shadow, remember)
        self._publisher = rospy.Publisher(
            ros.name("twin_controller/state"), TwinControllerState, queue_size=1
        )
        self._timer = rospy.Timer(
            rospy.Duration(0.05), lambda _: self._publisher.publish(self.state)
        )

    def fall_silent(self) -> None:
        """Publish no more."""
        self._timer.shutdown()

    def close(self) -> None:
        """Leave."""
        self._timer.shutdown()
        self._publisher.unregister()
        self._service.shutdown()
        self._control.shutdown()
        self._memory.shutdown()


@contextlib.contextmanager
def in_control(panel: Panel, stand_in: StandIn, signs: bool = True) -> Iterator[ClientConnection]:
    """Open a page with the token that has touched a button: it holds control, and keeps it.

    Without ``signs`` it says nothing more.
    """
    stand_in.state.holder = ""
    before = len(stand_in.asked)
    with panel.live(panel.enter(), signs=signs) as live:
        live.send('{"hold": 0, "joint": "joint_1", "direction": 1, "percent": 3}')
        wait_until(
            lambda: "KEEP" in [action for _, action, _ in stand_in.asked[before:]], 20.0, "KEEP"
        )
        yield live
