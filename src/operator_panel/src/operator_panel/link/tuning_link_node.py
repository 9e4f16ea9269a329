"""The simulator's tuning servers, by the standard topics and service of dynamic_reconfigure."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping, Sequence
from functools import partial

import rospy
from dynamic_reconfigure.msg import BoolParameter, Config, ConfigDescription, DoubleParameter
from dynamic_reconfigure.srv import Reconfigure
from std_msgs.msg import String
from std_srvs.srv import Trigger

from operator_panel.control.calling_node import Lane, as_answer
from operator_panel.door import Answer, Gains

REASON_S = (
    0.3  # our choice: the reason of a refusal comes by a topic, just before or after the answer
)


class TuningLink:
    """The gains of all joints."""

    def __init__(self, joints: Sequence[str], timeout: float) -> None:
        """Remember the joints; a call may take ``timeout`` [s]."""
        self._lanes = {
            joint: Lane(f"twin/pid/{joint}/set_parameters", Reconfigure, timeout)
            for joint in joints
        }
        self._undo = Lane("twin/pid/undo", Trigger, timeout)
        self._ranges: dict[str, dict[str, tuple[float, float]]] = {}
        self._configs: dict[str, tuple[Config, int]] = {}
        self._said = ""

    def subscribe(self) -> None:
        """Hear of values, ranges and reasons."""
        for joint in self._lanes:
            name = f"twin/pid/{joint}"
            rospy.Subscriber(
                f"{name}/parameter_descriptions",
                ConfigDescription,
                partial(self._described, joint),
                queue_size=1,
            )
            rospy.Subscriber(
                f"{name}/parameter_updates", Config, partial(self._updated, joint), queue_size=1
            )
        rospy.Subscriber("twin/pid/status", String, self._status, queue_size=10)

    def gains(self, joint: str) -> Gains | None:
        """Return what a joint's server has published; None while there is none."""
        if joint not in self._configs:
            return None
        config, told = self._configs[joint]
        values = {parameter.name: parameter.value for parameter in config.doubles}
        switches = {parameter.name: parameter.value for parameter in config.bools}
        return Gains(values, self._ranges.get(joint, {}), switches, told)

    async def set(
        self, joint: str, values: Mapping[str, float], switches: Mapping[str, bool]
    ) -> Answer:
        """Set the parameters that differ; the server takes all of them or none."""
        now = self.gains(joint)
        wanted = {
            name: value
            for name, value in values.items()
            if now is None or now.values.get(name) != value
        }
        turned = {
            name: on for name, on in switches.items() if now is None or now.switches.get(name) != on
        }
        if not wanted and not turned:
            return Answer(True, "nothing to change")
        self._said = ""
        doubles = [DoubleParameter(name, value) for name, value in wanted.items()]
        response = await self._lanes[joint].call(
            config=Config(doubles=doubles, bools=[BoolParameter(*item) for item in turned.items()])
        )
        if isinstance(response, Answer):
            return response
        taken = {
            parameter.name: parameter.value
            for parameter in (*response.config.doubles, *response.config.bools)
        }
        done = all(
            # The simulator says its number back as it keeps it, which may differ in the last digit.
            abs(taken.get(name, value) - value) <= 1e-9 * max(1.0, abs(value))
            for name, value in {**wanted, **turned}.items()
        )
        # The reason comes on a topic of its own, perhaps a little after the answer.
        for _ in range(10):
            if self._said:
                break
            await asyncio.sleep(REASON_S / 10)
        return Answer(done, self._said or ("set" if done else "the simulator kept its values"))

    async def undo(self) -> Answer:
        """Take the last change back."""
        return as_answer(await self._undo.call())

    def _described(self, joint: str, message: ConfigDescription) -> None:
        highest = {parameter.name: parameter.value for parameter in message.max.doubles}
        self._ranges[joint] = {
            p.name: (p.value, highest[p.name]) for p in message.min.doubles if p.name in highest
        }

    def _updated(self, joint: str, message: Config) -> None:
        _, told = self._configs.get(joint, (None, 0))
        self._configs[joint] = message, told + 1

    def _status(self, message: String) -> None:
        self._said = message.data
