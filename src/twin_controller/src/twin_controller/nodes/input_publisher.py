"""The topic ``twin_controller/inputs``: each batch of inputs, and now and then the state before it."""

from __future__ import annotations

import time

import rospy

from scara_msgs.msg import CoreInput
from twin_controller.config import TwinControllerConfig
from twin_controller.core.events import AnyEvent
from twin_controller.core.state import CoreState, initial_state
from twin_controller.reporting.snapshots import encode_events, encode_state

SNAPSHOT_PERIOD_S = 1.0  # our choice: a replay checks itself this often, and what a lost message costs ends here


class InputPublisher(rospy.SubscribeListener):  # type: ignore[misc]  # rospy has no types
    """Publishes from the engine's thread; a new subscriber, such as a recorder, gets a state with the next batch."""

    def __init__(self, config: TwinControllerConfig) -> None:
        """Advertise."""
        super().__init__()
        self._before = initial_state(config)
        self._seq = 0
        self._life = f"{time.time():.6f}"
        self._due = 0.0
        self._publisher = rospy.Publisher(
            "twin_controller/inputs", CoreInput, queue_size=1000, tcp_nodelay=True, subscriber_listener=self
        )

    def peer_subscribe(self, topic_name: str, topic_publish: object, peer_publish: object) -> None:
        """Let the next batch carry a state."""
        self._due = 0.0

    def publish(self, events: list[AnyEvent], after: CoreState, stamp: rospy.Time) -> None:
        """Publish one batch.

        Args:
            events: The inputs, in the order in which they were judged.
            after: The state after them.
            stamp: When, ROS time.
        """
        now, state = time.monotonic(), b""
        if now >= self._due:
            self._due = now + SNAPSHOT_PERIOD_S
            state = self._snapshot()
        self._seq += 1
        self._before = after
        header = rospy.Header(stamp=stamp, frame_id=self._life)
        self._publisher.publish(CoreInput(header, self._seq, encode_events(events), state))

    def _snapshot(self) -> bytes:
        """Return the state before the batch; what cannot be recorded must not stop the controller."""
        try:
            return encode_state(self._before)
        except TypeError as error:
            rospy.logerr_throttle(60.0, "inputs: the state cannot be recorded: %s", error)
            return b""
