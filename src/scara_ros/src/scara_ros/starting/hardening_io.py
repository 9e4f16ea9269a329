"""What every process of the cell does before it becomes a node."""

from __future__ import annotations

from scara_ros.starting.full_disk_io import outlive_full_disk
from scara_ros.starting.xmlrpc_guard_io import refuse_pages


def harden_process() -> None:
    """Outlive a full disk and refuse web pages; a second call changes nothing.

    Best before ``rospy.init_node``; later it still covers the servers and logs that exist then.
    """
    outlive_full_disk()
    refuse_pages()
