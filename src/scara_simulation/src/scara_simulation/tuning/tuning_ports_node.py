"""Tuning over ROS: a dynamic_reconfigure server for each joint, and undo.

It is made of dynamic_reconfigure's standard messages.

``twin/pid/<joint>/set_parameters``, ``parameter_descriptions`` and ``parameter_updates`` are what
rqt_reconfigure, dynparam and dynamic_reconfigure.client look for. A value out of range is refused
with the whole request, not clamped: the answer holds the old values, and ``twin/pid/status`` tells
the reason.
"""

from __future__ import annotations

import threading
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path

import rospy
from dynamic_reconfigure.msg import (
    BoolParameter,
    Config,
    ConfigDescription,
    DoubleParameter,
    Group,
    GroupState,
    ParamDescription,
)
from dynamic_reconfigure.srv import Reconfigure, ReconfigureRequest, ReconfigureResponse
from scara_config import ConfigError
from scara_config.programs.keeping import is_copy
from scara_config.writer import write_values
from std_msgs.msg import String
from std_srvs.srv import Trigger, TriggerRequest, TriggerResponse

from scara_simulation.config import gains_path
from scara_simulation.real_time_runner_io import RealTimeRunner
from scara_simulation.tuning.gains import PARAMETERS, Change, Tuning, TuningError, value_of

_GROUP = "Default"
_MEANINGS = {
    "p": "effort [N m] or [N] for each {unit} of error",
    "i": "effort [N m] or [N] for each {unit} of error and second",
    "d": "effort [N m] or [N] for each {unit} a second by which the error grows",
    "i_clamp": "largest effort of the integral term [N m] or [N]",
    "antiwindup": (
        "bound the integrated error itself, so that it leaves its bound as soon as "
        "the error changes sign"
    ),
}
_UNITS = {"position": "rad or m", "velocity": "rad/s or m/s"}


class TuningPorts:
    """Offers the gains of all joints.

    Changes are made one after the other: in the loop first, then in the file.
    """

    def __init__(
        self, joints: Sequence[str], runner: RealTimeRunner, tuning: Tuning, directory: Path
    ) -> None:
        """Advertise and serve; ``directory`` is the folder of the configuration."""
        self._joints, self._runner, self._tuning = list(joints), runner, tuning
        self._file = gains_path(directory)
        # The next start makes another copy. Nothing goes into what was copied: a change of the farm
        # may be in these gains.
        self._saved = "saved until this cell ends" if is_copy(directory) else "saved"
        self._lock = threading.Lock()
        self._status = rospy.Publisher("twin/pid/status", String, queue_size=10, latch=True)
        self._descriptions, self._updates = (
            {
                name: rospy.Publisher(f"twin/pid/{name}/{topic}", kind, queue_size=10, latch=True)
                for name in joints
            }
            for topic, kind in (
                ("parameter_descriptions", ConfigDescription),
                ("parameter_updates", Config),
            )
        )
        for name in joints:
            self._tell(name)
            rospy.Service(f"twin/pid/{name}/set_parameters", Reconfigure, partial(self._set, name))
        rospy.Service("twin/pid/undo", Trigger, self._undo)

    def _set(self, joint: str, request: ReconfigureRequest) -> ReconfigureResponse:
        """Change gains of one joint, all that the request names or none."""
        with self._lock:
            try:
                config = request.config
                named = (*config.doubles, *config.ints, *config.bools, *config.strs)
                change = self._tuning.propose(joint, {each.name: each.value for each in named})
            except TuningError as error:
                self._say(rospy.logerr, f"refused: {error}")
            else:
                # A request that changes nothing must leave the file and the list of undo as they
                # are.
                if any(change.values()):
                    self._tuning.accept(change)
                    self._perform(change, "set")
            return ReconfigureResponse(config=_config(self._numbers(joint)))

    def _undo(self, _: TriggerRequest) -> TriggerResponse:
        """Take the last change back, in the loop and in the file."""
        with self._lock:
            try:
                change = self._tuning.undo()
            except TuningError as error:
                return TriggerResponse(success=False, message=str(error))
            return TriggerResponse(success=True, message=self._perform(change, "undone"))

    def _perform(self, change: Change, what: str) -> str:
        """Let a change be in force, save it, tell everybody; return what was said."""
        with self._runner.lock:
            self._runner.simulation.control.set_gains(change.joint, change.after)
        self._tell(change.joint)
        for joint in self._tuning.coupled(change.joint):
            self._describe(joint)
        try:
            write_values(
                self._file,
                {(change.joint, *PARAMETERS[name]): after for name, _, after in change.values()},
            )
        except ConfigError as error:
            return self._say(rospy.logerr, f"{what}, but not saved: {change.describe()}: {error}")
        return self._say(rospy.loginfo, f"{what} and {self._saved}: {change.describe()}")

    def _say(self, log: object, text: str) -> str:
        log(text)  # type: ignore[operator]
        self._status.publish(String(data=text))
        return text

    def _tell(self, joint: str) -> None:
        """Publish a joint's ranges, then its gains."""
        self._describe(joint)
        self._updates[joint].publish(_config(self._numbers(joint)))

    def _describe(self, joint: str) -> None:
        """Publish a joint's ranges, which depend on the other gains, also of coupled joints."""
        numbers, ranges = self._numbers(joint), self._tuning.ranges(joint)
        lower, upper = (
            {name: ranges[name][side] if name in ranges else bool(side) for name in PARAMETERS}
            for side in (0, 1)
        )
        group = Group(
            name=_GROUP,
            type="",
            parameters=[_description(name) for name in PARAMETERS],
            parent=0,
            id=0,
        )
        self._descriptions[joint].publish(
            ConfigDescription(
                groups=[group], min=_config(lower), max=_config(upper), dflt=_config(numbers)
            )
        )

    def _numbers(self, joint: str) -> dict[str, float | bool]:
        return {name: value_of(self._tuning.gains(joint), name) for name in PARAMETERS}


def _config(values: Mapping[str, float | bool]) -> Config:
    return Config(
        bools=[
            BoolParameter(name, value) for name, value in values.items() if isinstance(value, bool)
        ],
        doubles=[
            DoubleParameter(name, value)
            for name, value in values.items()
            if not isinstance(value, bool)
        ],
        groups=[GroupState(name=_GROUP, state=True, id=0, parent=0)],
    )


def _description(name: str) -> ParamDescription:
    kind, key = PARAMETERS[name]
    text = f"{kind} loop: " + _MEANINGS[key].format(unit=_UNITS[kind])
    return ParamDescription(
        name=name,
        type="bool" if key == "antiwindup" else "double",
        level=0,
        description=text,
        edit_method="",
    )
