"""Service calls of web-socket clients: types looked up once, each call with a deadline."""

from __future__ import annotations

import io
from typing import Any

import genpy
import rosgraph
import roslib.message
import rospy
from scara_ros.nodes.registration import UNREACHABLE, MasterError, MasterLine

from scara_simulation.io.gateway_graph import GraphError
from scara_simulation.io.ros_service import ServiceCallError, ServiceLine
from scara_simulation.rosbridge.conversion import Converter, Converters

_LOOKUP_TIMEOUT = 2.0  # our choice: a roscore that hangs must not hold a call for longer than its own time


class ServiceTypes:
    """The types of services, asked for at their first call."""

    def __init__(self, converters: Converters) -> None:
        self._converters = converters
        self._classes: dict[str, Any] = {}

    def of(self, service: str, timeout: float) -> Any:
        """Return the class of a service's type.

        Raises:
            GraphError: There is no such service, or its type is unknown here.
            ServiceCallError: It cannot be reached within ``timeout`` [s].
        """
        if service not in self._classes:
            self._classes[service] = find_service_class(self.type_name(service, timeout))
        return self._classes[service]

    def forget(self, service: str) -> None:
        """Ask again at the next call: the service may have been started anew with another type."""
        self._classes.pop(service, None)

    def type_name(self, service: str, timeout: float) -> str:
        """Ask a service for the name of its type; raises like :meth:`of`."""
        with open_service(service, timeout) as line:
            return line.type

    def converters(self, service_class: Any) -> tuple[Converter, Converter]:
        """Return the converters of a service's request and response."""
        return self._converters.by_class(service_class._request_class), self._converters.by_class(service_class._response_class)


class RosServiceCall:
    """One service call with a deadline; ``cancel`` may come from another thread."""

    def __init__(self, types: ServiceTypes, service: str, args: Any, timeout: float, caller: str) -> None:
        self._types = types
        self._service = service
        self._args = args
        self._timeout = timeout
        self._caller = caller
        self._line: ServiceLine | None = None
        self._cancelled = False

    def run(self) -> dict[str, Any]:
        """Call and return the response's values.

        Raises:
            GraphError: There is no such service, it failed or was too slow.
            ConversionError: The arguments do not fit its type.
        """
        try:
            service_class = self._types.of(self._service, self._timeout)
            request, response = self._types.converters(service_class)
            payload = _serialise(request.to_message(self._args))
            with open_service(self._service, self._timeout, service_class._md5sum, self._caller) as self._line:
                if self._cancelled:
                    raise GraphError(f"service {self._service}: the caller has gone")
                answer = response.message_class()
                answer.deserialize(self._line.call(payload))
        except ServiceCallError as error:
            self._types.forget(self._service)
            raise GraphError(str(error)) from error
        except genpy.MessageException as error:
            raise GraphError(f"service {self._service}: {error}") from error
        return response.to_values(answer)

    def cancel(self) -> None:
        """End a running call."""
        self._cancelled = True
        if self._line is not None:
            self._line.close()


def open_service(service: str, timeout: float, md5sum: str | None = None, caller: str | None = None) -> ServiceLine:
    """Connect to a service in the name of ``caller`` (default: this node); without ``md5sum`` only to ask for its type.

    Raises:
        GraphError: There is none of that name, or no master.
        ServiceCallError: It cannot be reached within ``timeout`` [s].
    """
    try:
        uri = MasterLine(rosgraph.get_master_uri(), timeout=min(timeout, _LOOKUP_TIMEOUT)).ask("lookupService", service)
    except MasterError as error:
        raise GraphError(f"service {service} does not exist") from error
    except UNREACHABLE as error:
        raise GraphError(f"service {service}: roscore does not answer: {error}") from error
    return ServiceLine(service, uri, caller or rospy.get_name(), timeout, md5sum)


def find_service_class(type_name: str) -> Any:
    """Return the class of ``package/Type``.

    Raises:
        GraphError: The type is unknown here.
    """
    try:
        found = roslib.message.get_service_class(type_name)
    except ValueError as error:
        raise GraphError(f"unknown service type {type_name!r}: {error}") from error
    if found is None:
        raise GraphError(f"unknown service type {type_name!r}: no package on this machine has it")
    return found


def _serialise(message: Any) -> bytes:
    buffer = io.BytesIO()
    message.serialize(buffer)
    return buffer.getvalue()
