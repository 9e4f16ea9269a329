"""The running service calls of one client."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, Protocol

from rosbridge_gateway.admission.places import Visitor
from rosbridge_gateway.config import GatewayConfig
from rosbridge_gateway.io.graph import Graph, GraphError, ServiceCall
from rosbridge_gateway.protocol.conversion import ConversionError
from rosbridge_gateway.protocol.packets import CallService
from rosbridge_gateway.protocol.persons import with_person
from rosbridge_gateway.rosapi import answers
from rosbridge_gateway.rosapi.errors import RequestError


class Shared(Protocol):
    """What the calls of all clients share; the server."""

    config: GatewayConfig
    graph: Graph
    call_threads: ThreadPoolExecutor
    page_call_threads: ThreadPoolExecutor
    namespace: str
    calls: int
    errors: int
    person_services: frozenset[str]
    log: Callable[[str], None]


class Caller(Protocol):
    """Who calls; the client."""

    owner: int
    caller: str
    visitor: Visitor

    def respond(self, packet: CallService, values: dict[str, Any]) -> None:
        """Send an answer."""

    def charge(self, seconds: float) -> None:
        """Charge processor time [s]."""

    def refuse_call(self, packet: CallService, name: str, reason: str) -> None:
        """Send the reason why there is no answer."""

    def called(self, packet: CallService, name: str, values: dict[str, Any]) -> None:
        """Note for the audit what came of a call."""


class Calls:
    """Starts calls, each in a thread of its own; an answer goes out when its call ends."""

    def __init__(self, client: Caller, shared: Shared) -> None:
        self._client = client
        self._shared = shared
        self._loop = asyncio.get_running_loop()
        self._running: dict[asyncio.Task[None], ServiceCall | None] = {}

    def __len__(self) -> int:
        return len(self._running)

    def start(self, packet: CallService, name: str) -> None:
        """Begin a call of the service ``name``; rosapi's time is answered at once.

        Raises:
            GraphError: Too many calls run.
        """
        shared, client = self._shared, self._client
        own = answers.service_of(name, shared.namespace)
        if own == answers.GET_TIME:
            client.respond(packet, answers.time_values(*shared.graph.now()))
            return
        own_limit = shared.config.roles[client.visitor.role].takes.calls
        limit = shared.config.limits.calls
        together = 0 if client.visitor.is_page else shared.calls  # pages have threads of their own
        if len(self._running) >= own_limit or together >= limit:
            raise GraphError(
                f"{len(self._running)} of {own_limit} calls of this client and {together} of "
                f"{limit} calls of all run: {name} refused; call again when one has ended"
            )
        if own is not None:
            graph = shared.graph
            tell = own in answers.WRITES
            self._begin(packet, name, None, lambda: answers.answer(own, packet.args, graph), tell)
            return
        args, config = packet.args, shared.config
        timeout = min(packet.timeout or config.service_timeout, config.service_timeout_max)
        if name in shared.person_services:
            args = with_person(args, client.visitor.person, client.visitor.token, client.owner)
        call = shared.graph.service_call(name, args, timeout, client.caller)
        self._begin(packet, name, call, call.run, True)

    def cancel(self) -> None:
        """End all calls that can be ended; each is answered with an error."""
        for call in self._running.values():
            if call is not None:
                call.cancel()

    def _begin(
        self,
        packet: CallService,
        name: str,
        call: ServiceCall | None,
        ask: Callable[[], dict[str, Any]],
        tell: bool,
    ) -> None:
        task = self._loop.create_task(self._run(packet, name, ask, tell))
        self._shared.calls += not self._client.visitor.is_page
        self._running[task] = call
        task.add_done_callback(self._ended)

    async def _run(
        self, packet: CallService, name: str, ask: Callable[[], dict[str, Any]], tell: bool
    ) -> None:
        client, shared = self._client, self._shared
        threads = shared.page_call_threads if client.visitor.is_page else shared.call_threads
        spent: list[float] = []

        def timed() -> dict[str, Any]:
            begun = time.thread_time()
            try:
                return ask()
            finally:
                spent.append(time.thread_time() - begun)

        try:
            values = await self._loop.run_in_executor(threads, timed)
            client.respond(packet, values)
            if tell:
                client.called(packet, name, values)
        except (GraphError, ConversionError, RequestError) as error:
            client.refuse_call(packet, name, str(error))
        except Exception as error:
            self._shared.errors += 1
            self._shared.log(f"error while calling {name}: {error!r}")
            client.refuse_call(packet, name, f"error in the gateway: {error!r}")
        finally:
            client.charge(sum(spent))

    def _ended(self, task: asyncio.Task[None]) -> None:
        self._shared.calls -= not self._client.visitor.is_page
        self._running.pop(task, None)
