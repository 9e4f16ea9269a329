"""Ask the second world's judge before a motion begins, and tell what came of it."""

from __future__ import annotations

from typing import Any

import rospy

from scara_ros.gate.permit import SWITCHED_OFF, Judgement, Permit, permit, unjudged
from scara_ros.gate.settings import Act, GateSettings
from scara_ros.services.service_client_node import ServiceClient
from scara_ros.services.service_connection_io import (
    ServiceError,
    ServiceMissingError,
    ServiceTimeoutError,
)

_LOG_PERIOD = 10.0
REFUSED = "REFUSED"
"""As in scara_msgs/JudgeMotion, which is above this room."""
TOLD = "what_if/gate"
"""The topic on which gates tell what they found."""
MISSING = "no judge runs (rosrun what_if what_if starts one)"


class JudgeGate:
    """A node's gate. It blocks its caller, so a stop must never stand behind it.

    Args:
        settings: what_if.yaml.
        question: scara_msgs/JudgeMotion, which is above this room, as the next one.
        word: scara_msgs/Audit.
        patience: A motion waits for its judgement so long at most [s].
    """

    def __init__(self, settings: GateSettings, question: Any, word: Any, patience: float) -> None:
        self._settings = settings
        self._judge = ServiceClient("what_if/judge", question, patience)
        self._told = rospy.Publisher(TOLD, word, queue_size=20, tcp_nodelay=True)

    @property
    def is_off(self) -> bool:
        """Whether nobody is asked at all."""
        return self._settings.gate is Act.OFF

    def ask(self, what: str, who: str = "", **request: Any) -> Permit:
        """Return whether a motion may begin.

        Args:
            what: The motion in words.
            who: Who wants it; empty: this node.
            request: Fields of scara_msgs/JudgeMotion.
        """
        if self.is_off:
            return SWITCHED_OFF
        found = self._judged(request)
        told = self._told
        header = rospy.Header(stamp=rospy.get_rostime())
        who = who or rospy.get_name()
        told.publish(told.data_class(header, who, what, found.allowed, found.text))
        if not found.allowed:
            rospy.logwarn("%s: refused: %s", what, found.text)
        elif found.note:
            rospy.logwarn("%s: %s", what, found.note)
        return found

    def _judged(self, request: dict[str, Any]) -> Permit:
        try:
            answer = self._judge(**request)
        except ServiceMissingError:
            return unjudged(self._settings, MISSING)
        except ServiceTimeoutError as late:
            rospy.logwarn_throttle(_LOG_PERIOD, f"the judge is late: {late}")
            return unjudged(self._settings, str(late))
        except (ServiceError, rospy.ROSException, OSError) as error:
            rospy.logwarn_throttle(_LOG_PERIOD, f"the judge cannot be asked: {error}")
            return unjudged(self._settings, str(error))
        if not answer.success:
            return unjudged(self._settings, answer.message)
        return permit(self._settings, judgement_of(answer))


def judgement_of(answer: Any) -> Judgement:
    """Convert an answer of ``what_if/judge``."""
    place = (answer.place.x, answer.place.y, answer.place.z)
    return Judgement(
        refused=answer.verdict == REFUSED,
        sentence=answer.message,
        cause=answer.cause,
        place_mm=(1e3 * place[0], 1e3 * place[1], 1e3 * place[2]) if any(place) else None,
    )
