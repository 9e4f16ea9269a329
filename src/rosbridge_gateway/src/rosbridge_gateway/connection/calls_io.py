"""The running service calls of one client."""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, Protocol

from rosbridge_gateway.admission.places import Visitor
from rosbridge_gateway.config import GatewayConfig
from rosbridge_gateway.graph.graph_io import Graph, GraphError, ServiceCall
from rosbridge_gateway.protocol.conversion import ConversionError
from rosbridge_gateway.protocol.packets import CallService
from rosbridge_gateway.protocol.roles import with_person
from rosbridge_gateway.rosapi import answers
from rosbridge_gateway.rosapi.errors import RequestError

_STOPS_OF_ONE = 16  # our choice: so many stops of one client wait for their answers


class CallsShared(Protocol):
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
    """Starts calls, each in a thread of its own; an answer goes out when its call ends.

    They begin in order: a call of the same service waits until the one before has begun, and the
    client's next packet waits for that too, but not for long. A call has begun when its request has
    gone to its service. One that stops waits for nothing.
    """

    def __init__(self, client: Caller, shared: CallsShared) -> None:
        self._client = client
        self._shared = shared
        self._loop = asyncio.get_running_loop()
        self._running: dict[asyncio.Task[None], ServiceCall | None] = {}
        self._begun: dict[str, asyncio.Event] = {}
        """Of each service, whether the newest call has begun."""
        # Threads of its own: a stop waits for no call, and for no other client's stops either.
        self._stop_threads = ThreadPoolExecutor(_STOPS_OF_ONE, "gateway_stop")
        self._stops: dict[ServiceCall, asyncio.Event] = {}
        """The stops that run, the oldest first, and whether they have begun."""
        self._gone = False

    def __len__(self) -> int:
        return len(self._running)

    async def start(self, packet: CallService, name: str, came: float, stops: bool) -> None:
        """Begin a call of the service ``name``; rosapi's time is answered at once.

        Return when it has begun, or after ``begin_timeout``: whatever comes behind it goes on then.

        Args:
            packet: The call.
            name: Absolute name of the service.
            came: When the packet came (monotonic, [s]).
            stops: It stops a robot.

        Raises:
            GraphError: Too many calls run.
        """
        shared, client = self._shared, self._client
        own = answers.service_of(name, shared.namespace)
        if own == answers.GET_TIME:
            client.respond(packet, answers.time_values(*shared.graph.now()))
            return
        if not stops:
            self._check_limits(name)
        if own is not None:
            graph = shared.graph
            writes = own in answers.WRITES
            done = asyncio.Event()
            self._begin(
                packet, name, None, lambda: answers.answer(own, packet.args, graph), writes, done
            )
            if writes:  # what is read next is what was written
                await self._wait(done)
            return
        args, config = packet.args, shared.config
        timeout = min(packet.timeout or config.service_timeout, config.service_timeout_max)
        if name in shared.person_services:
            args = with_person(args, client.visitor.person, client.visitor.token, client.owner)
        call = shared.graph.service_call(name, args, timeout, client.caller, came)
        begun = asyncio.Event()

        def began() -> None:
            begun.set()
            if self._gone:
                call.cancel()

        def tell() -> None:
            try:
                self._loop.call_soon_threadsafe(began)
            except RuntimeError:  # the loop has ended
                call.cancel()

        if stops:
            self._free_a_thread()
            self._stops[call] = begun
            self._begin(packet, name, call, lambda: call.run(tell), True, begun, stops=True)
        else:
            before, self._begun[name] = self._begun.get(name), begun
            self._begin(packet, name, call, lambda: call.run(tell), True, begun, before)
        await self._wait(begun)

    async def _wait(self, event: asyncio.Event) -> None:
        with contextlib.suppress(asyncio.TimeoutError):
            await asyncio.wait_for(event.wait(), self._shared.config.begin_timeout)

    def _check_limits(self, name: str) -> None:
        shared = self._shared
        own_limit = shared.config.roles[self._client.visitor.role].takes.calls
        limit = shared.config.limits.calls
        together = shared.calls if self._is_counted else 0
        if len(self._running) >= own_limit or together >= limit:
            raise GraphError(
                f"{len(self._running)} of {own_limit} calls of this client and {together} of "
                f"{limit} calls of all run: {name} refused; call again when one has ended"
            )

    @property
    def _is_counted(self) -> bool:
        """Whether its calls count among those of all.

        Pages, and roles with places of their own, have threads for theirs: no call of others that
        hangs may keep the twin controller from moving the twin.
        """
        visitor = self._client.visitor
        return not (visitor.is_page or self._shared.config.roles[visitor.role].places)

    def _free_a_thread(self) -> None:
        """Give up the answer of the oldest stop that has gone to its service, if many wait."""
        if len(self._stops) >= _STOPS_OF_ONE:
            for call, begun in self._stops.items():
                if begun.is_set():
                    del self._stops[call]
                    call.cancel()
                    return

    def cancel(self) -> None:
        """End all calls that can be ended; each is answered with an error.

        A stop ends only once it has gone to its service, also when its sender leaves at once.
        """
        self._gone = True
        for call in self._running.values():
            begun = None if call is None else self._stops.get(call)
            if call is not None and (begun is None or begun.is_set()):
                call.cancel()
        self._stop_threads.shutdown(wait=False)

    def _begin(
        self,
        packet: CallService,
        name: str,
        call: ServiceCall | None,
        ask: Callable[[], dict[str, Any]],
        tell: bool,
        begun: asyncio.Event,
        before: asyncio.Event | None = None,
        stops: bool = False,
    ) -> None:
        task = self._loop.create_task(self._run(packet, name, ask, tell, before, stops))
        self._shared.calls += self._is_counted
        self._running[task] = call

        def ended(_: asyncio.Task[None]) -> None:
            self._shared.calls -= self._is_counted
            self._running.pop(task, None)
            if call is not None:
                self._stops.pop(call, None)
            begun.set()
            if self._begun.get(name) is begun:
                del self._begun[name]

        task.add_done_callback(ended)

    async def _run(
        self,
        packet: CallService,
        name: str,
        ask: Callable[[], dict[str, Any]],
        tell: bool,
        before: asyncio.Event | None,
        stops: bool,
    ) -> None:
        client, shared = self._client, self._shared
        spent: list[float] = []

        def timed() -> dict[str, Any]:
            begun = time.thread_time()
            try:
                return ask()
            finally:
                spent.append(time.thread_time() - begun + shared.graph.helped())

        if before is not None:
            await before.wait()
        threads = shared.call_threads
        if stops:
            threads = self._stop_threads
        elif client.visitor.is_page:
            threads = shared.page_call_threads
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
