"""Keep web pages away from the XML-RPC servers of the master and of all nodes.

Any page that a browser on this machine shows could send ``shutdown`` to a node: a request of plain
text needs nobody's consent. A browser names the page in the header Origin, which no ROS client
sends. A page whose name was pointed at this machine meanwhile has no foreign Origin, but it has a
foreign Host.
"""

from __future__ import annotations

import logging
import socket
import threading
import time
from collections.abc import Mapping
from http import HTTPStatus
from typing import Any
from urllib.parse import urlsplit

import rosgraph
from rosgraph.xmlrpc import SilenceableXMLRPCRequestHandler
from scara_config.quantities import is_this_machine

from scara_ros.pacing import Pace
from scara_ros.starting.full_disk_io import outlive_full_disk

TELL_PERIOD_S = 10.0  # our choice: a page that asks again and again fills no log
SHOWN = 80  # our choice: so many characters of a stranger's header are shown


def refusal(headers: Mapping[str, str], own_names: frozenset[str]) -> str:
    """Say why a request is not taken; empty for one that a ROS client may have sent.

    Args:
        headers: Of the request; names in the case that the mapping asks for.
        own_names: Host names and addresses of this machine, in lower case, as URIs of this cell
            contain them. Loopback need not be among them.
    """
    origin = headers.get("Origin")
    if origin is not None:
        return f"it comes from a web page ({origin[:SHOWN]!r})"
    host = headers.get("Host") or ""
    try:
        name = urlsplit(f"//{host}").hostname or ""
    except ValueError:
        name = ""
    if name in own_names or is_this_machine(name):
        return ""
    return f"it asks for the host {host[:SHOWN]!r}, which is not this machine's name in ROS"


def refuse_pages() -> None:
    """Guard all XML-RPC servers of this process, those too that run already."""
    handler = SilenceableXMLRPCRequestHandler
    if getattr(handler, "refuses_pages", False):
        return
    take, teller = handler.do_POST, _Teller()

    def take_if_ours(self: Any) -> None:
        reason = refusal(self.headers, _own_names(self.connection))
        if not reason:
            take(self)
            return
        teller.tell(reason)
        # What the stranger has sent is not read: it must not become the next request.
        self.close_connection = True
        self.send_error(HTTPStatus.FORBIDDEN, "refused", reason)

    handler.do_POST = take_if_ours
    handler.refuses_pages = True


class _Teller:
    """Logs refusals, the first at once, the others counted."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._pace = Pace(TELL_PERIOD_S)
        self._count = 0

    def tell(self, reason: str) -> None:
        with self._lock:
            self._count += 1
            if not self._pace.is_due(time.monotonic()):
                return
            count, self._count = self._count, 0
        logging.getLogger("rosout").warning(
            "refused %d requests to this process's XML-RPC server; the last one: %s", count, reason
        )


def _own_names(connection: socket.socket) -> frozenset[str]:
    """Return the names by which a client of ROS may have found this very connection."""
    names = (
        connection.getsockname()[0],
        rosgraph.network.get_host_name(),
        socket.gethostname(),
        urlsplit(rosgraph.get_master_uri()).hostname or "",
    )
    return frozenset(name.lower() for name in names if name)


def harden_process() -> None:
    """Outlive a full disk and refuse web pages; a second call changes nothing.

    What every process of the cell does before it becomes a node: best before ``rospy.init_node``;
    later it still covers the servers and logs that exist then.
    """
    outlive_full_disk()
    refuse_pages()
