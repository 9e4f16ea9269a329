"""Calls of ROS services that end: each has a deadline, with or without a master."""

from __future__ import annotations

import io
import threading
import time
from collections.abc import Callable
from typing import Any

import rosgraph
import rospy

from scara_ros.services.service_connection_io import (
    ServiceConnection,
    ServiceError,
    ServiceMissingError,
    ServiceTimeoutError,
)
from scara_ros.starting.master_io import UNREACHABLE, MasterClient, MasterError

LOOKUP_TIMEOUT_S = 2.0  # our choice: a master that hangs must not take all of a call's time
ASKED = "asked"
"""The field of a request that may move something: see scara_msgs/MoveTo."""
RETRY_S = 0.05  # our choice: how soon a service that is not there yet is looked for again


class StartedCall:
    """A call in a thread of its own, so that its caller can look around while it lasts."""

    def __init__(self, client: ServiceClient, request: Any) -> None:
        """Begin."""
        self.ended = threading.Event()
        self._answer: Any = None
        self._error: Exception | None = None
        threading.Thread(target=self._run, args=(client, request), daemon=True).start()

    def _run(self, client: ServiceClient, request: Any) -> None:
        try:
            self._answer = client.call(request)
        except Exception as error:
            self._error = error
        self.ended.set()

    def result(self) -> Any:
        """Return the answer or raise what the call raised."""
        if self._error is not None:
            raise self._error
        return self._answer


class ServiceClient:
    """Calls one service; safe to use from several threads, and built without a master.

    A kept connection needs no master; it is opened anew when the service was started anew.
    Without a master the last known address is tried. A request that was sent is never repeated:
    it may have been obeyed.
    """

    def __init__(
        self,
        name: str,
        kind: Any,
        timeout: float,
        *,
        wait: float = 0.0,
        keep: bool = False,
        lasting: bool = False,
        caller: str | None = None,
        address: str = "",
    ) -> None:
        """Remember the service; nothing is called yet.

        Args:
            name: Resolved at each connection, in the namespace of this node.
            kind: The service's class.
            timeout: Of a call, the look-up included [s].
            wait: How long a call waits for a service that is not there yet [s].
            keep: Keep the connection for the next call; calls then follow one another.
            lasting: A call may take longer than ``timeout`` as long as the service's node answers.
            caller: Name to call in; default: this node's.
            address: Where the service was when another client called it.
        """
        self._name, self._kind, self._timeout = name, kind, timeout
        self._wait, self._keep, self._lasting, self._caller = wait, keep, lasting, caller
        # A kept connection serves one call at a time; who waits for it does so within the
        # deadline.
        self._turn = threading.Lock()
        self._kept: ServiceConnection | None = None
        # Calls under way, which `close` ends.
        self._running: set[ServiceConnection] = set()
        self.address = address
        """Where the service was last: tried where no master answers."""
        self._closed = False

    def __call__(self, **fields: Any) -> Any:
        """Call with the request's fields; see :meth:`call`."""
        return self.call(self._request(fields))

    def start(self, **fields: Any) -> StartedCall:
        """Begin a call and return at once."""
        return StartedCall(self, self._request(fields))

    def _request(self, fields: dict[str, Any]) -> Any:
        """Build the request. One that says when it was asked for is asked for now by default."""
        request = self._kind._request_class(**fields)
        if not getattr(request, ASKED, 1.0):
            request.asked = time.monotonic()
        return request

    def call(self, request: Any, sent: Callable[[], None] | None = None) -> Any:
        """Send a request and return the response.

        Args:
            request: Of the service's type.
            sent: Called once it has been sent, before the service has answered.

        Raises:
            ServiceTimeoutError: It was not answered in time: it may still be done.
            ServiceMissingError: There is no such service.
            ServiceError: The service or the master cannot be reached, or the service failed.
        """
        buffer = io.BytesIO()
        request.serialize(buffer)
        payload = buffer.getvalue()
        if not self._keep:
            return self._call_on(self._connect(), payload, None, sent)
        if not self._turn.acquire(timeout=self._timeout):
            raise ServiceTimeoutError(f"service {self._name}: an older call has not ended")
        try:
            if self._kept is not None and self._kept.is_open():
                return self._call_on(self._kept, payload, self._timeout, sent)
            self.disconnect()
            self._kept = self._connect()
            return self._call_on(self._kept, payload, None, sent)
        finally:
            self._turn.release()

    def close(self) -> None:
        """End running calls and refuse new ones."""
        self._closed = True
        for connection in [*self._running, self._kept]:
            if connection is not None:
                connection.close()

    def disconnect(self) -> None:
        """Give the kept connection up; the next call opens another."""
        kept, self._kept = self._kept, None
        if kept is not None:
            kept.close()

    def _call_on(
        self,
        connection: ServiceConnection,
        payload: bytes,
        timeout: float | None,
        sent: Callable[[], None] | None,
    ) -> Any:
        """Call; without ``timeout`` the call has what connecting has left."""
        self._running.add(connection)
        try:
            if self._closed:
                raise ServiceError(f"service {self._name}: the caller has gone")
            alive = self._answers if self._lasting else None
            response = self._kind._response_class()
            response.deserialize(connection.call(payload, timeout, alive, sent))
        except ServiceError:
            if connection is self._kept:
                self._kept = None
            connection.close()
            raise
        finally:
            self._running.discard(connection)
            if not self._keep:
                connection.close()
        return response

    def _connect(self) -> ServiceConnection:
        """Connect to the service; wait for it if that was asked for."""
        until = time.monotonic() + self._wait
        while True:
            try:
                begun, service = time.monotonic(), rospy.resolve_name(self._name)
                # The rest is for the call, at the last address where no master answers.
                lookup_timeout = min(0.5 * self._timeout, LOOKUP_TIMEOUT_S)
                self.address = look_up(service, lookup_timeout, self.address)
                caller, md5sum = self._caller or rospy.get_caller_id(), self._kind._md5sum
                return ServiceConnection(
                    service, self.address, caller, self._timeout, md5sum, self._keep, begun
                )
            except ServiceTimeoutError:
                raise
            except ServiceError:
                if time.monotonic() >= until or rospy.core.is_shutdown_requested():
                    raise
            time.sleep(RETRY_S)

    def _answers(self) -> bool:
        """Return whether the service's node still answers; it does so while it serves a call."""
        service, caller = rospy.resolve_name(self._name), rospy.get_caller_id()
        try:
            ServiceConnection(service, self.address, caller, self._timeout).close()
        except ServiceError:
            return False
        return True


def look_up(service: str, timeout: float, known: str = "") -> str:
    """Return the address of a service; ``known`` is what to return if the master does not answer.

    Raises:
        ServiceMissingError: There is none of that name.
        ServiceError: The master does not answer.
    """
    master = MasterClient(rosgraph.get_master_uri(), rospy.get_caller_id(), timeout)
    try:
        return str(master.ask("lookupService", service))
    except MasterError as error:
        raise ServiceMissingError(f"service {service} does not exist") from error
    except UNREACHABLE as error:
        if known:
            return known
        raise ServiceError(f"service {service}: roscore does not answer: {error}") from error


def service_type(service: str, timeout: float, known: str = "") -> str:
    """Ask a service for the name of its type, at its ``known`` address if no master answers.

    Raises:
        ServiceError: There is none, or it cannot be reached within ``timeout`` [s].
    """
    begun, service = time.monotonic(), rospy.resolve_name(service)
    uri = look_up(service, min(0.5 * timeout, LOOKUP_TIMEOUT_S), known)
    with ServiceConnection(service, uri, rospy.get_caller_id(), timeout, begun=begun) as line:
        return line.type


def is_offered(service: str, timeout: float) -> bool:
    """Return whether a service is known and its node answers within ``timeout`` [s]."""
    try:
        service_type(service, timeout)
    except ServiceError:
        return False
    return True
