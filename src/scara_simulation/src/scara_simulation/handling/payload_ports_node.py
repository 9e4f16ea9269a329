"""The twin's payload over ROS.

Services ``twin/payload/set`` (what the controller is told), ``twin/payload/mount`` (what truly
hangs at the simulated tool), ``twin/payload/list``; topic ``twin/payload``.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Sequence
from functools import partial

import rospy
from geometry_msgs.msg import Vector3
from scara_config.payload import Payload, PayloadError
from scara_ros.diagnosis import Diagnosis, Level
from scara_ros.diagnostics_node import Diagnostics
from scara_ros.pacing import Pace

from scara_msgs.msg import Payload as PayloadMessage
from scara_msgs.msg import PayloadState
from scara_msgs.srv import (
    ListPayloads,
    ListPayloadsRequest,
    ListPayloadsResponse,
    SetPayload,
    SetPayloadRequest,
    SetPayloadResponse,
)
from scara_simulation.handling.part_world_io import PartWorld
from scara_simulation.handling.payload_desk import PayloadDesk, described, same_body
from scara_simulation.handling.told_dynamics_io import ToldDynamics
from scara_simulation.real_time_runner_io import RealTimeRunner
from scara_simulation.world_io import World

DIAGNOSTICS_PERIOD_NS = 1_000_000_000


class PayloadPorts:
    """Sets, mounts and tells payloads."""

    def __init__(
        self,
        desk: PayloadDesk,
        part: Payload | None,
        joints: Sequence[str],
        world: World,
        told: ToldDynamics,
        effort_percent: float,
    ) -> None:
        """Advertise; the controller's accelerations follow at :meth:`serve`."""
        self._desk, self._part, self._joints = desk, part, list(joints)
        self._world, self._told, self._effort_percent = world, told, effort_percent
        self._shares = told.unplanned_shares(effort_percent)
        self._state = rospy.Publisher("twin/payload", PayloadState, queue_size=10, latch=True)
        self._shown: bool | None = None
        self._diagnostics, self._pace = Diagnostics("simulator"), Pace(DIAGNOSTICS_PERIOD_NS)
        self._lock = threading.Lock()

    def serve(self, runner: RealTimeRunner) -> None:
        """Offer the services."""
        self._runner, self._control = runner, runner.simulation.control
        self._control.permit(self._shares)
        rospy.Service("twin/payload/set", SetPayload, partial(self._change, self._tell))
        rospy.Service("twin/payload/mount", SetPayload, partial(self._change, self._mount))
        rospy.Service("twin/payload/list", ListPayloads, self._list)

    def publish(self, stamp_ns: int) -> None:
        """Publish the state if a part was gripped or let go, and each second how that fits.

        Args:
            stamp_ns: Nominal time of the simulation [ns].
        """
        if bool(self._held()) != self._shown:
            self._publish()
        if self._pace.is_due(stamp_ns, (self._desk.told, self._desk.mounted)):
            stamp = rospy.Time(stamp_ns // 1_000_000_000, stamp_ns % 1_000_000_000)
            self._diagnostics.publish(self._diagnosis(), stamp=stamp)

    def _diagnosis(self) -> Diagnosis:
        """Warn while the controller believes in another payload than hangs there."""
        told, mounted = self._desk.told, self._desk.mounted
        fits = same_body(told, mounted)
        text = f"told {described(told)}"
        return Diagnosis(
            Level.OK if fits else Level.WARN,
            f"{rospy.get_name()}: payload",
            text if fits else f"{text}; mounted is {described(mounted)}: tell what hangs there",
            {"told [kg]": told.mass_kg, "mounted [kg]": mounted.mass_kg},
        )

    def _held(self) -> str:
        """Return the name of the part that is held."""
        return self._world.now.suction.held if isinstance(self._world, PartWorld) else ""

    def _change(
        self, act: Callable[[Payload], str], request: SetPayloadRequest
    ) -> SetPayloadResponse:
        """Judge a request, and act, all joints at rest."""
        # One request after the other, for the table is judged and replaced under two holds of a
        # lock.
        with self._lock:
            try:
                with self._runner.lock:
                    values = self._asked(request) if request.change else None
                    moving = self._control.moving(self._world.read()[1])
                    table, payload = self._desk.judge(request.number, values, moving)
                    text = act(payload)
            except PayloadError as error:
                rospy.logwarn("payload refused: %s", error)
                return SetPayloadResponse(False, str(error))
            self._desk.table = table
            # Without the runner's lock, as it takes long.
            shares = self._told.unplanned_shares(self._effort_percent)
            with self._runner.lock:
                self._shares = shares
                self._control.permit(shares)
            self._publish()
        rospy.loginfo("%s", text)
        return SetPayloadResponse(True, text)

    def _tell(self, payload: Payload) -> str:
        """Let the controller reckon with a payload. The runner's lock is held."""
        self._told.tell(payload)
        self._desk.told = payload
        return f"the controller was told {described(payload)}"

    def _mount(self, payload: Payload) -> str:
        """Hang a payload at the simulated tool. The runner's lock is held."""
        held = self._held()
        if held:
            raise PayloadError(f"{held} is held: let it go before the tool is changed")
        self._world.mount(payload)
        self._desk.mounted = payload
        return f"mounted {described(payload)}; all parts are back where they began"

    def _asked(self, request: SetPayloadRequest) -> Payload:
        """Return the values of a request as an entry of the table."""
        entry = self._desk.table.find(request.number)
        centre, inertia = request.centre, request.inertia
        numbers = (request.mass, *_three(centre), *_three(inertia))
        if not all(map(math.isfinite, numbers)):
            raise PayloadError(f"mass, centre, inertia = {list(numbers)}: not finite")
        return Payload(entry.number, entry.name, request.mass, _three(centre), _three(inertia))

    def _list(self, _: ListPayloadsRequest) -> ListPayloadsResponse:
        desk = self._desk
        return ListPayloadsResponse(
            success=True,
            message=(
                f"the controller was told {described(desk.told)}; mounted is "
                f"{described(desk.mounted)}"
            ),
            rated=desk.table.rated_kg,
            told=desk.told.number,
            mounted=desk.mounted.number,
            payloads=[_message(payload) for payload in desk.table.payloads],
        )

    def _publish(self) -> None:
        self._shown = bool(self._held())
        state = PayloadState(
            told=_message(self._desk.told),
            mounted=_message(self._desk.mounted),
            holding=self._shown,
            part=_message(self._part) if self._part else PayloadMessage(),
            name=self._joints,
            acceleration_percent=[100.0 * share for share in self._shares],
        )
        state.header.stamp = rospy.Time.now()
        self._state.publish(state)


def _three(vector: Vector3) -> tuple[float, float, float]:
    return vector.x, vector.y, vector.z


def _message(payload: Payload) -> PayloadMessage:
    return PayloadMessage(
        number=payload.number,
        name=payload.name,
        mass=payload.mass_kg,
        centre=Vector3(*payload.centre_m),
        inertia=Vector3(*payload.inertia_kg_m2),
    )
