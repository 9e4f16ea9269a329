"""A service's line that is opened before it is used: who calls knows when the request really left.

rospy looks up, connects and sends in one call; a node that stands still greets nobody, and a
request that has not been sent cannot be held against it.
"""

from __future__ import annotations

import io
import xmlrpc.client
from typing import Any

from genpy.message import fill_message_args
from roslib.message import get_service_class
from scara_ros.services.service_connection_io import ServiceConnection, ServiceMissingError

CONNECT_S = 2.0


class ServiceLine:
    """One connection to a service, greeted already; a context manager."""

    def __init__(
        self,
        master: str,
        service: str,
        kind: type[Any] | None,
        caller: str,
        patience: float = CONNECT_S,
    ) -> None:
        """Ask the master where the service is, connect, and wait for its greeting.

        Args:
            master: Its address.
            service: Its whole name.
            kind: Its class; None: the one that it names in its greeting.
            caller: The name of the node that calls.
            patience: For its greeting [s].

        Raises:
            ServiceError: It is not there, or does not greet.
        """
        found: Any = xmlrpc.client.ServerProxy(master).lookupService(caller, service)
        if found[0] != 1:
            raise ServiceMissingError(f"{service}: {found[1]}")
        md5sum = kind._md5sum if kind else "*"
        self._line = ServiceConnection(service, found[2], caller, patience, md5sum)
        self._kind: Any = kind or get_service_class(self._line.type)
        self.close = self._line.close

    def __enter__(self) -> ServiceLine:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def call(self, timeout: float, **fields: Any) -> Any:
        """Send the request and return the answer; a message in it may be given as its fields.

        Raises:
            ServiceError: None came within ``timeout`` [s], or the service has failed.
        """
        nested = {name: value for name, value in fields.items() if isinstance(value, (dict, list))}
        plain = {name: value for name, value in fields.items() if name not in nested}
        request = self._kind._request_class(**plain)
        fill_message_args(request, [nested])
        buffer = io.BytesIO()
        request.serialize(buffer)
        return self._kind._response_class().deserialize(self._line.call(buffer.getvalue(), timeout))
