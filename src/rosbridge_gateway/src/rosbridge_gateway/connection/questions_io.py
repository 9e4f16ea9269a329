"""Service requests from ROS that a web-socket client answers."""

from __future__ import annotations

import asyncio
import itertools
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any

from rosbridge_gateway.graph.graph_io import Ask, GraphError
from rosbridge_gateway.protocol.packets import CallService, Packet, ServiceResponse

Values = dict[str, Any]


class Questions:
    """The unanswered questions to one client.

    It lives in the event loop; ``asker`` hands questions over from other threads.
    """

    def __init__(self, loop: asyncio.AbstractEventLoop, send: Callable[[Packet], None]) -> None:
        self._loop = loop
        self._send = send
        self._numbers = itertools.count(1)
        self._waiting: dict[str, tuple[str, Future[Values]]] = {}
        self._closed = False

    def asker(self, service: str) -> Ask:
        """Return what another thread uses to put a question.

        Args:
            service: Name as the client wrote it.
        """

        def ask(args: Values) -> Future[Values]:
            future: Future[Values] = Future()
            self._loop.call_soon_threadsafe(self._put, service, args, future)
            return future

        return ask

    def _put(self, service: str, args: Values, future: Future[Values]) -> None:
        if self._closed:
            future.set_exception(GraphError(f"the client that answers {service} has gone"))
            return
        question = f"{service}:{next(self._numbers)}"
        self._waiting[question] = (service, future)
        future.add_done_callback(
            lambda _: self._loop.call_soon_threadsafe(self._waiting.pop, question, None)
        )
        self._send(CallService(id=question, service=service, args=args))

    def answered(self, packet: ServiceResponse) -> None:
        """Hand a response to who asked; without an id the oldest question to that service is meant.

        Raises:
            GraphError: Nobody waits for it.
        """
        question = packet.id if isinstance(packet.id, str) else None
        if question is None:
            question = next(
                (q for q, (service, _) in self._waiting.items() if service == packet.service), None
            )
        _, future = self._waiting.pop(question or "", (None, None))
        if future is None or not future.set_running_or_notify_cancel():
            raise GraphError(
                f"no call of {packet.service} waits for a response with id {packet.id!r}"
            )
        # With result false too: for rosbridge_server it is the values that answer.
        if isinstance(packet.values, dict):
            future.set_result(packet.values)
        else:
            future.set_exception(GraphError(f"{packet.service} failed: {packet.values!r}"))

    def close(self) -> None:
        """Fail all questions, those to come too: the client has gone."""
        self._closed = True
        for service, future in list(self._waiting.values()):
            if future.set_running_or_notify_cancel():
                future.set_exception(GraphError(f"the client that answers {service} has gone"))
