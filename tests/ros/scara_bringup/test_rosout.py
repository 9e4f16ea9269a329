"""The collector of logs that stands in for Debian's."""

from __future__ import annotations

import rospy
from harness.ros import Ros
from rosgraph_msgs.msg import Log
from scara_bringup.processes.ports_io import listeners, sockets


def test_what_a_node_logs_is_handed_on_and_written_down(ros: Ros) -> None:
    """Whoever looks at /rosout_agg or into rosout.log sees the same."""
    ros.run("scara_bringup", "rosout", env={"ROS_LOG_DIR": str(ros.folder)})
    collected = ros.collect("/rosout_agg", Log)
    publisher = ros.publisher("/rosout", Log, subscribers=1)

    def handed_on() -> bool:
        publisher.publish(Log(level=Log.WARN, name="/some_node", msg="the door is open"))
        return any(log.msg == "the door is open" for log in collected)

    ros.wait_until(handed_on, 10.0, "the message on /rosout_agg")
    text = (ros.folder / "rosout.log").read_text()
    assert "WARN /some_node: the door is open\n" in text


def test_it_listens_at_loopback_only_and_keeps_its_own_node_name(ros: Ros) -> None:
    """Debian's listened on 0.0.0.0 and obeyed a shutdown from the network."""
    process = ros.run("scara_bringup", "rosout", env={"ROS_LOG_DIR": str(ros.folder)})
    ros.wait_until(
        lambda: ros.name("rosout") in [name for name, _ in _publishers("/rosout_agg")],
        20.0,
        "the collector",
    )
    held = {inode for pid, _, inodes in sockets() if pid == process.pid for inode in inodes}
    own = [listener for listener in listeners() if listener.inode in held]
    assert len(own) >= 2
    assert all(listener.is_loopback for listener in own), own


def _publishers(topic: str) -> list[tuple[str, str]]:
    """List the publishers of a topic."""
    state = rospy.get_master().getSystemState()[2][0]
    return [(node, name) for name, nodes in state for node in nodes if name == topic]
