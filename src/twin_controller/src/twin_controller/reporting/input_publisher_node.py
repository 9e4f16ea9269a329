"""The topic ``twin_controller/inputs``: each batch of inputs, and sometimes the state before."""

from __future__ import annotations

import time

import rospy
from scara_ros.pacing import Pace

from scara_msgs.msg import CoreInput
from twin_controller.core.events import AnyEvent
from twin_controller.core.setup import Setup
from twin_controller.core.state import CoreState, initial_state
from twin_controller.reporting.snapshots import encode_events, encode_state

SNAPSHOT_PERIOD_S = (
    1.0  # our choice: a replay checks itself this often, and what a lost message costs ends here
)


class InputPublisher(rospy.SubscribeListener):  # type: ignore[misc]  # rospy has no types
    """Publishes from the publisher's thread.

    A new subscriber, such as a recorder, gets a state with the next batch.
    """

    def __init__(self, setup: Setup) -> None:
        """Advertise."""
        super().__init__()
        self._before = initial_state(setup)
        self._seq = 0
        self._life = f"{time.time():.6f}"
        self._pace = Pace(SNAPSHOT_PERIOD_S)
        self._publisher = rospy.Publisher(
            "twin_controller/inputs",
            CoreInput,
            queue_size=1000,
            tcp_nodelay=True,
            subscriber_listener=self,
        )

    def peer_subscribe(self, topic_name: str, topic_publish: object, peer_publish: object) -> None:
        """Let the next batch carry a state."""
        self._pace.hurry()

    def publish(
        self, events: list[AnyEvent], after: CoreState, stamp: rospy.Time, lost: int = 0
    ) -> None:
        """Publish some inputs; while nobody listens they are only counted.

        Args:
            events: The inputs, in the order in which they were judged.
            after: The state after them.
            stamp: When, ROS time.
            lost: So many batches before these could not be published; a replay sees the gap.
        """
        before, self._before = self._before, after
        self._seq += 1 + lost
        if not self._publisher.get_num_connections():
            return
        # Behind lost batches the state that is kept is not the one before these inputs.
        state = _snapshot(before) if self._pace.is_due(time.monotonic()) and not lost else b""
        header = rospy.Header(stamp=stamp, frame_id=self._life)
        self._publisher.publish(CoreInput(header, self._seq, encode_events(events), state))


def _snapshot(state: CoreState) -> bytes:
    """Return a state for the record; one that cannot be recorded stops nothing."""
    try:
        return encode_state(state)
    except TypeError as error:
        rospy.logerr_throttle(60.0, "inputs: the state cannot be recorded: %s", error)
        return b""
