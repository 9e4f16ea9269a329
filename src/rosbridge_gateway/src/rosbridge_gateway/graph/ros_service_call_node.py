"""Service calls of web-socket clients: types looked up once, each call with a deadline."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import genpy
import roslib.message
from scara_ros.services.service_client_node import ServiceClient, service_type
from scara_ros.services.service_connection_io import ServiceError

from rosbridge_gateway.graph.graph_io import GraphError
from rosbridge_gateway.protocol.conversion import Arrival, Converter, Converters


class ServiceTypes:
    """The types of services, asked for at their first call, and where they were at the last."""

    def __init__(self, converters: Converters) -> None:
        self._converters = converters
        self._classes: dict[str, Any] = {}
        self.addresses: dict[str, str] = {}
        """Without a master these are tried: a STOP needs none."""

    def of(self, service: str, timeout: float) -> Any:
        """Return the class of a service's type.

        Raises:
            GraphError: Its type is unknown here.
            ServiceError: There is none, or it cannot be reached within ``timeout`` [s].
        """
        if service not in self._classes:
            known = self.addresses.get(service, "")
            self._classes[service] = find_service_class(service_type(service, timeout, known))
        return self._classes[service]

    def forget(self, service: str) -> None:
        """Ask again at the next call: the service may have been started anew, with another type."""
        self._classes.pop(service, None)

    def converters(self, service_class: Any) -> tuple[Converter, Converter]:
        """Return the converters of a service's request and response."""
        return self._converters.by_class(service_class._request_class), self._converters.by_class(
            service_class._response_class
        )


class RosServiceCall:
    """One service call with a deadline; ``cancel`` may come from another thread."""

    def __init__(
        self,
        types: ServiceTypes,
        service: str,
        args: Any,
        timeout: float,
        caller: str,
        arrival: Arrival,
    ) -> None:
        self._types = types
        self._service = service
        self._args = args
        self._timeout = timeout
        self._caller = caller
        self._arrival = arrival
        self._client: ServiceClient | None = None
        self._cancelled = False

    def run(self, begun: Callable[[], None]) -> dict[str, Any]:
        """Call and return the response's values; ``begun`` is called once the request is sent.

        Raises:
            GraphError: There is no such service, it failed or was too slow.
            ConversionError: The arguments do not fit its type.
        """
        try:
            service_class = self._types.of(self._service, self._timeout)
            request, response = self._types.converters(service_class)
            message = request.to_message(self._args, self._arrival)
            self._client = ServiceClient(
                self._service,
                service_class,
                self._timeout,
                caller=self._caller,
                address=self._types.addresses.get(self._service, ""),
            )
            if self._cancelled:
                self._client.close()
            answer = self._client.call(message, begun)
            self._types.addresses[self._service] = self._client.address
        except ServiceError as error:
            self._types.forget(self._service)
            raise GraphError(str(error)) from error
        except genpy.MessageException as error:
            raise GraphError(f"service {self._service}: {error}") from error
        return response.to_values(answer)

    def cancel(self) -> None:
        """End a running call."""
        self._cancelled = True
        if self._client is not None:
            self._client.close()


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
