"""The gateway's web-socket server: an event loop in one thread, sync on the outside."""

from __future__ import annotations

import asyncio
import contextlib
import functools
import itertools
import logging
import math
import socket
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from http import HTTPStatus
from typing import Any
from weakref import WeakKeyDictionary

from typing_extensions import Self
from websockets.asyncio.server import ServerConnection, serve
from websockets.frames import CloseCode
from websockets.http11 import Request, Response

from rosbridge_gateway.admission.door_io import Door, NotAdmittedError, bind, tls_context
from rosbridge_gateway.admission.places import NoPlaceError, Visitor, find_place
from rosbridge_gateway.admission.stops import Drivers, StopRules
from rosbridge_gateway.config import GatewayConfig
from rosbridge_gateway.connection.client_io import Client
from rosbridge_gateway.connection.line_io import Line, Poll
from rosbridge_gateway.graph.graph_io import Graph, Message
from rosbridge_gateway.protocol.audit import Trail
from rosbridge_gateway.protocol.names import resolve
from rosbridge_gateway.protocol.rate import Budget, RateLimit
from rosbridge_gateway.protocol.roles import Roles
from rosbridge_gateway.protocol.session import Session
from rosbridge_gateway.wire.png_io import unpack

_HARD_SIZE_FACTOR = 8  # our choice: so much longer a packet may be and still be answered
_REFUSING = 0.05  # our choice: processor time [s/s] for telling clients that they are turned away
_SILENT = logging.getLogger("rosbridge_gateway.websockets")
_SILENT.addHandler(logging.NullHandler())
_SILENT.propagate = False


@dataclass(frozen=True, slots=True)
class Statistics:
    """What the gateway has seen since its start."""

    clients: int
    turned_away: int
    received: int
    refused: int
    dropped: int
    errors: int
    calls: int


class GatewayServer:
    """The web-socket door; a context manager."""

    def __init__(
        self,
        config: GatewayConfig,
        graph: Graph,
        namespace: str,
        tokens: Mapping[str, str],
        log: Callable[[str], None],
        persons: Mapping[str, str] | None = None,
    ) -> None:
        """Bind the port.

        Args:
            config: gateway.yaml.
            graph: The ROS side.
            namespace: Where names without a leading slash stand.
            tokens: Role by token.
            log: Takes one line for people.
            persons: Person by token.

        Raises:
            GatewayError: The port is taken, or the TLS files cannot be read.
        """
        self.config = config
        self.graph = graph
        self.namespace = namespace
        self.log = log
        self.listeners: dict[str, set[Client]] = {}
        self.calls = 0
        self.errors = 0
        # One thread, so that what a client asks of the graph happens in its order.
        self.graph_thread = ThreadPoolExecutor(1, "gateway_graph")
        # Calls may hang until their deadline; pages cannot take the threads of programs.
        own = sum(role.places * role.takes.calls for role in config.roles.values())
        self.call_threads = ThreadPoolExecutor(config.limits.calls + own, "gateway_call")
        self.page_call_threads = ThreadPoolExecutor(config.limits.page_calls, "gateway_page_call")
        self.person_services = frozenset(
            resolve(name, namespace) for name in config.person_services
        )
        self.drivers = Drivers(config.driving, namespace)
        self.stop_rules = StopRules(config.stops, namespace)
        self._door = Door(config, tokens, persons)
        self._roles = Roles(config.roles, config.reserved, namespace)
        self._tls = tls_context(config)
        self._socket = bind(config)
        self._clients: dict[int, Client] = {}
        # Who shakes hands; one that does not finish is forgotten with its connection.
        now, burst = time.monotonic(), config.limits.burst
        # Of all clients of a role together: many that each keep their budget must not starve the
        # loop.
        self._shared_cpu = {
            name: RateLimit.full(role.takes.cpu_percent_together / 100.0, burst, now)
            for name, role in config.roles.items()
        }
        # Of all that come and go as a role together: what one of them may take. It delays nobody of
        # another role, and nobody who is in, whose packet may be a STOP.
        self._coming: dict[str | None, RateLimit] = {
            name: RateLimit.full(role.takes.cpu_percent / 100.0, burst, now)
            for name, role in config.roles.items()
        }
        self._coming[None] = RateLimit.full(_REFUSING, burst, now)
        self._visitors: WeakKeyDictionary[ServerConnection, Visitor] = WeakKeyDictionary()
        self._owners = itertools.count(1)
        self._turned_away = 0
        self._trail = Trail(time.monotonic())
        # Counters of clients that have gone; those of the others are added when somebody asks.
        self._past = [0, 0, 0]
        self._poll = Poll()
        self._loop = asyncio.SelectorEventLoop(self._poll)
        self._loop.set_exception_handler(self._callback_failed)
        self._stop = asyncio.Event()
        self._ready = threading.Event()
        self._failure: BaseException | None = None
        self._thread = threading.Thread(target=self._run, name="gateway_loop", daemon=True)

    @property
    def port(self) -> int:
        """The port in use (chosen by the system when the configured one is 0)."""
        return int(self._socket.getsockname()[1])

    @property
    def failure(self) -> BaseException | None:
        """What ended the server's thread, if anything did."""
        return self._failure

    def start(self) -> None:
        """Serve, in a thread."""
        self._thread.start()
        self._ready.wait()

    def stop(self) -> None:
        """Send close frames, wait for all clients and threads to end."""
        if self._thread.is_alive():
            with contextlib.suppress(RuntimeError):
                self._loop.call_soon_threadsafe(self._stop.set)
            self._thread.join()
        self.call_threads.shutdown(wait=True, cancel_futures=True)
        self.page_call_threads.shutdown(wait=True, cancel_futures=True)
        self.graph_thread.shutdown(wait=True)
        self._socket.close()

    def __enter__(self) -> Self:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    def deliver(self, topic: str, message: Message, owner: int | None = None) -> None:
        """Hand a topic's message to all its listeners or to one.

        Callable from any thread.
        """
        with contextlib.suppress(RuntimeError):  # the loop has ended
            self._loop.call_soon_threadsafe(self._fan_out, topic, message, owner)

    def remark(self, owner: int, text: str) -> None:
        """Tell a client something; callable from any thread."""

        def tell() -> None:
            client = self._clients.get(owner)
            if client is not None:
                client.remark(text)

        with contextlib.suppress(RuntimeError):  # the loop has ended
            self._loop.call_soon_threadsafe(tell)

    def _fan_out(self, topic: str, message: Message, owner: int | None) -> None:
        for client in tuple(self.listeners.get(topic, ())):
            if owner in (None, client.owner):
                client.deliver(topic, message)

    def _callback_failed(self, loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        """Count and tell what went wrong in a callback of the loop; nobody else would see it."""
        self.errors += 1
        self.log(f"error in the gateway: {context.get('exception') or context.get('message')!r}")

    def statistics(self) -> Statistics:
        """Return the counters; roughly right while clients come and go."""
        clients = tuple(self._clients.values())
        received, refused, dropped = (
            past + sum(part)
            for past, part in zip(
                self._past,
                (
                    [c.session.counters.received for c in clients],
                    [c.session.counters.refused for c in clients],
                    [c.sending.outbox.dropped for c in clients],
                ),
            )
        )
        return Statistics(
            len(clients), self._turned_away, received, refused, dropped, self.errors, self.calls
        )

    def _run(self) -> None:
        asyncio.set_event_loop(self._loop)
        try:
            self._loop.run_until_complete(self._serve())
        except BaseException as error:
            self._failure = error
            self.log(f"gateway's server ended: {error!r}")
        finally:
            self._ready.set()
            self._loop.close()

    async def _serve(self) -> None:
        config = self.config
        longest = max(role.takes.packet_bytes for role in config.roles.values())
        async with serve(
            self._attend,
            sock=self._socket,
            ssl=self._tls,
            compression=None,
            process_request=self._admit,
            create_connection=functools.partial(Line, self._poll),  # type: ignore[arg-type]
            max_size=_HARD_SIZE_FACTOR * longest,
            ping_interval=None,  # the clients watch themselves
            close_timeout=config.close_timeout,
            open_timeout=config.handshake_timeout,
            logger=_SILENT,
        ) as server:
            self._ready.set()
            await self._stop.wait()
            server.close(reason="the gateway ends")
            await server.wait_closed()

    async def _admit(self, connection: ServerConnection, request: Request) -> Response | None:
        """Turn a client away with an HTTP status and a reason, or let it in.

        Either comes later where those who come and go take more of the loop than they may.
        """
        host, role, response = connection.remote_address[0], None, None
        begun, now = time.thread_time(), time.monotonic()
        try:
            visitor = self._door.admit(host, request.headers, request.path, now)
            self._find_place(visitor)
            role = visitor.role
        except (NotAdmittedError, NoPlaceError) as error:
            response = self._turn_away(connection, error)
        coming = self._coming[role]
        coming.spend(time.thread_time() - begun, now)
        wait = coming.wait(time.monotonic())
        if wait:
            await asyncio.sleep(min(wait, 0.5 * self.config.handshake_timeout))
        if response is None:
            self._visitors[connection] = visitor
        return response

    @contextlib.contextmanager
    def _charged(self, role: str) -> Iterator[None]:
        """Charge the processor time of what is done within to all that come and go as a role."""
        begun = time.thread_time()
        try:
            yield
        finally:
            self._coming[role].spend(time.thread_time() - begun, time.monotonic())

    def _turn_away(
        self, connection: ServerConnection, error: NotAdmittedError | NoPlaceError
    ) -> Response:
        self._turned_away += 1
        reason, peer = str(error), _peer(connection)
        entry = self._trail.note(
            f"connect from {peer.rpartition(':')[0]}", None, False, reason, time.monotonic()
        )
        if entry is not None:
            self.graph.audit(f"nobody@{peer}", entry)
        self.log(f"client {peer} turned away: {reason}")
        if isinstance(error, NoPlaceError):
            return connection.respond(HTTPStatus.SERVICE_UNAVAILABLE, reason + "\n")
        response = connection.respond(error.status, reason + "\n")
        if error.retry_after:
            response.headers["Retry-After"] = str(math.ceil(error.retry_after))
        return response

    def _find_place(self, visitor: Visitor) -> int | None:
        seats = [client.seat for client in self._clients.values() if not client.is_gone]
        return find_place(visitor, seats, self.config.roles, self.config.limits.clients)

    def _budget(self, role: str, now: float) -> Budget:
        takes, burst = self.config.roles[role].takes, self.config.limits.burst
        return Budget(
            takes.packets_per_second,
            takes.bytes_per_second,
            takes.cpu_percent / 100.0,
            burst,
            now,
            self._shared_cpu[role],
        )

    async def _attend(self, connection: ServerConnection) -> None:
        """Serve one client from handshake to end."""
        assert isinstance(connection, Line)  # as we have told serve
        visitor = self._visitors.pop(connection)
        try:
            leaves = self._find_place(visitor)
        except NoPlaceError as error:  # others came while this one was shaking hands
            self._turned_away += 1
            await connection.close(CloseCode.TRY_AGAIN_LATER, str(error))
            return
        if leaves is not None:
            self._clients[leaves].drop(f"made room for another {visitor.role}")
        with self._charged(visitor.role):
            client = self._begin(connection, visitor)
        try:
            await client.run()
        except Exception as error:
            client.drop(f"error in the gateway: {error!r}")
            self.errors += 1
            self.log(f"error while serving {_peer(connection)}: {error!r}")
        finally:
            with self._charged(visitor.role):
                self._end(client, connection)

    def _begin(self, connection: Line, visitor: Visitor) -> Client:
        line = connection.transport.get_extra_info("socket")
        line.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        line.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, self.config.limits.send_buffer_bytes)
        role = visitor.role
        owner = next(self._owners)
        limits, now = self.config.limits, time.monotonic()
        takes = self.config.roles[role].takes
        connection.budget = self._budget(role, now)
        connection.protocol.max_message_size = _HARD_SIZE_FACTOR * takes.packet_bytes
        session = Session(role, self._roles, self.namespace, limits, takes, now, unpack)
        peer = _peer(connection)
        caller = f"{role}@{peer}" if not visitor.person else f"{role}:{visitor.person}@{peer}"
        client = Client(owner, visitor, caller, connection, session, self)
        self._clients[client.owner] = client
        self.log(f"client {peer} came as {role}{f', {visitor.person}' if visitor.person else ''}")
        return client

    def _end(self, client: Client, connection: Line) -> None:
        del self._clients[client.owner]
        counts = client.session.counters
        # What the client said, else what we had to say.
        said = connection.protocol.close_rcvd or connection.protocol.close_sent
        farewell = f"code {int(said.code)} {said.reason}".rstrip() if said else ""
        reason = client.drop_reason or farewell or "connection lost"
        for index, count in enumerate(
            (counts.received, counts.refused, client.sending.outbox.dropped)
        ):
            self._past[index] += count
        self.log(
            f"client {_peer(connection)} left: {reason}; {counts.received} packets, "
            f"{counts.refused} refused, held back {counts.held_back} times, "
            f"{client.sending.outbox.dropped} older messages replaced"
        )


def _peer(connection: ServerConnection) -> str:
    host, port = (connection.remote_address or ("?", 0))[:2]
    return f"{host}:{port}"
