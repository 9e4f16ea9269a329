"""One web-socket client of the gateway, in the event loop's thread."""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, Protocol

from msgspec import UNSET
from websockets.exceptions import ConnectionClosed

from rosbridge_gateway.admission.places import Seat, Visitor
from rosbridge_gateway.admission.stops import Drivers, StopRules
from rosbridge_gateway.connection.calls_io import Calls, CallsShared
from rosbridge_gateway.connection.line_io import Line
from rosbridge_gateway.connection.questions_io import Questions
from rosbridge_gateway.connection.sending_io import Sending
from rosbridge_gateway.connection.turns_io import Turns
from rosbridge_gateway.graph.graph_io import Ask, GraphError, Message
from rosbridge_gateway.protocol import packets
from rosbridge_gateway.protocol.conversion import ConversionError
from rosbridge_gateway.protocol.packets import Packet, PacketId
from rosbridge_gateway.protocol.roles import taken
from rosbridge_gateway.protocol.session import Arrived, Request, Session, Wishes
from rosbridge_gateway.wire.fragments import split
from rosbridge_gateway.wire.outgoing import Form, Frames


class Shared(CallsShared, Protocol):
    """What all clients share; the server."""

    graph_thread: ThreadPoolExecutor
    drivers: Drivers
    stop_rules: StopRules
    listeners: dict[str, set[Client]]


class Client:
    """Performs what one session lets through, and sends what waits for it."""

    def __init__(
        self,
        owner: int,
        visitor: Visitor,
        caller: str,
        connection: Line,
        session: Session,
        shared: Shared,
    ) -> None:
        self.owner = owner
        self.caller = caller
        """Role, person if known, and address, in whose name the client acts."""
        self.session = session
        self.sending = Sending(connection, shared.config, self.drop)
        self.drop_reason: str | None = None
        """Why the gateway ended the connection; None if the client went by itself."""
        self.visitor = visitor
        # Set once, by its end or by `drop`: whatever is on its way back then goes nowhere.
        self._gone = False
        # When a packet came last. One that only publishes may leave pings unread.
        self._heard = time.monotonic()
        self._connection = connection
        self._shared = shared
        self._loop = asyncio.get_running_loop()
        self._keep_alive: asyncio.Task[None] | None = None
        # Whether it may move a robot: then pings are strict (decision 0020), and change with what
        # it advertises.
        self._drives = False
        # By topic, as it subscribed last: compression and length of the pieces.
        self._forms: dict[str, Form] = {}
        # Numbers long answers, whose pieces need an id that no other answer has.
        self._answers = 0
        self._calls = Calls(self, shared)
        self._turns = Turns(self._act)
        self._questions = Questions(self._loop, self.answer)

    async def run(self) -> None:
        """Serve the client until its connection ends, then free what it used."""
        self._pace_pings()
        try:
            while True:
                data = await self._connection.recv(decode=False)
                self._heard = time.monotonic()
                self._connection.packet()
                came = self._connection.taken_at()
                with self._connection.charged():
                    found = self.session.read(data, self._heard)
                if isinstance(found, Arrived):
                    await self._in_turn(found.packet, came)
                elif found is not None:
                    self.answer(found)
                self._tell_audit()
                # The others have their turn, and we wait as long as the budget says.
                wait = self._connection.wait()
                remark = self.session.held_back(wait, time.monotonic()) if wait else None
                if remark is not None:
                    self.answer(remark)
                await self._connection.make_way()
        except ConnectionClosed:
            pass
        finally:
            if self._keep_alive is not None:
                self._keep_alive.cancel()
            if self.drop_reason is not None:
                self._turns.forget()
            await self._turns.finish()  # what came before a client went is performed
            # Back everything in the graph. Running calls and unanswered questions end with an
            # error.
            self._gone = True
            self.sending.end()
            self._calls.cancel()
            self._questions.close()
            for name in self.session.subscriptions:
                self._stop_listening(name)
            await self._in_graph(self._leave_graph)

    async def _in_turn(self, packet: Packet, came: float) -> None:
        """Perform a packet behind those that came before; a stop at once."""
        stops = self._shared.stop_rules.stops(packet)
        if stops:  # it is newer than all that waited beside it, also in a standstill
            came = time.monotonic()
        answers = isinstance(packet, packets.ServiceResponse)  # who asked waits for it
        if answers or (self._turns.is_free and self.session.needs_no_turn(packet)):
            await self._act(packet, came, stops)
        elif stops:
            self._turns.overtake(self._act(packet, came, stops))
        else:
            await self._turns.put(packet, came)

    async def _act(self, packet: Packet, came: float, stops: bool = False) -> None:
        """Judge a packet in its turn, and perform it or answer it."""
        outcome = self.session.judge(packet, self._heard, stops)
        if isinstance(outcome, Request):
            if stops:
                self._shared.graph.stopped(came)
            await self._perform_safely(outcome, came, stops)
        elif outcome is not None:
            self.answer(outcome)
        self._tell_audit()

    def remark(self, text: str, packet_id: PacketId = UNSET) -> None:
        """Tell the client something that it has not asked for, about a packet of it if known."""
        status = self.session.status("error", text, packet_id)
        if status is not None:
            self.answer(status)

    def charge(self, seconds: float) -> None:
        """Charge processor time [s] that a thread has taken for this client."""
        self._connection.computed(seconds)

    def _pace_pings(self) -> None:
        """Ask for signs of life more often from now on if the client drives, less if not."""
        drives = self._shared.drivers.drives(self.session.role, self.session.advertisements)
        if self._keep_alive is not None:
            if drives == self._drives:
                return
            self._keep_alive.cancel()
        self._drives = drives
        config = self._shared.config
        pace = config.driving if drives else config
        self._keep_alive = self._loop.create_task(
            self._watch_silence(pace.ping_interval, pace.ping_timeout)
        )

    async def _watch_silence(self, interval: float, timeout: float) -> None:
        """Drop a client of which neither a pong nor a packet comes.

        One that only publishes may leave pings unread.
        """
        with contextlib.suppress(ConnectionClosed):
            while True:
                await asyncio.sleep(interval)
                asked = time.monotonic()
                try:
                    await asyncio.wait_for(await self._connection.ping(), timeout)
                except asyncio.TimeoutError:
                    if self._heard < asked:
                        self.drop(f"no answer to a ping within {timeout:g} s")
                        return

    async def _perform_safely(self, request: Request, came: float, stops: bool) -> None:
        """Perform; whatever fails is answered, and the client lives on."""
        try:
            remark = await self._perform(request, came, stops)
            if not isinstance(request.packet, packets.CallService):  # a call is told when it ends
                self.session.performed(request, remark or "done", self._heard)
            # The twin controller sees by itself whether it is obeyed, and sends again.
            if remark is not None and self.session.role not in self._shared.config.driving.roles:
                self.remark(remark, request.packet.id)
        except (GraphError, ConversionError) as error:
            self._refuse(request, str(error))
        except Exception as error:
            self._shared.errors += 1
            self._shared.log(f"error while serving {request.name}: {error!r}")
            self._refuse(request, f"error in the gateway: {error!r}")

    async def _perform(self, request: Request, came: float, stops: bool) -> str | None:
        """Do what the packet says; return a remark on it, or None."""
        graph, name = self._shared.graph, request.name
        match request.packet:
            case packets.Publish() as packet:
                if not self.session.is_advertised(name):
                    await self._in_graph(self._advertise, name, None, False, 100)
                    self.session.advertised(name, UNSET)
                    self._pace_pings()
                with self._connection.charged():
                    return graph.publish(self.owner, name, packet.msg, came)
            case packets.CallService() as packet:
                await self._calls.start(packet, name, came, stops)
            case packets.Subscribe() as packet:
                await self._subscribe(packet, name)
            case packets.Unsubscribe() as packet:
                await self._unsubscribe(packet, name)
            case packets.Advertise() as packet:
                await self._in_graph(
                    self._advertise, name, packet.type, packet.latch, packet.queue_size
                )
                self.session.advertised(name, packet.id)
                self._pace_pings()
            case packets.Unadvertise() as packet:
                if self.session.unadvertised(name, packet.id):
                    await self._in_graph(graph.unadvertise, self.owner, name)
                    self._pace_pings()
            case packets.AdvertiseService() as packet:
                ask = self._questions.asker(packet.service)
                await self._in_graph(self._advertise_service, name, packet.type, ask)
                self.session.provides(name, True)
            case packets.UnadvertiseService():
                await self._in_graph(graph.unadvertise_service, self.owner, name)
                self.session.provides(name, False)
            case packets.ServiceResponse() as packet:
                self._questions.answered(packet)
        return None

    async def _in_graph(self, function: Callable[..., Any], *args: Any) -> Any:
        """Run a function of the graph in the graph's thread; other clients are served meanwhile."""

        def timed() -> Any:
            begun = time.thread_time()
            try:
                return function(*args)
            finally:
                spent.append(time.thread_time() - begun)

        spent: list[float] = []
        try:
            return await self._loop.run_in_executor(self._shared.graph_thread, timed)
        finally:
            self.charge(sum(spent))

    def _advertise(self, name: str, kind: str | None, latch: bool, queue_size: int) -> None:
        """Open a publisher, unless another node publishes the topic now; in the graph's thread."""
        graph = self._shared.graph
        if not self.session.is_exempt("publish", name):
            self._refuse_taken(name, "published", graph.publishing_nodes(name))
        graph.advertise(self.owner, name, kind, latch, queue_size)

    def _advertise_service(self, name: str, kind: str, ask: Ask) -> None:
        """Offer a service, unless another node offers it now; in the graph's thread.

        For the master the last offer counts: the living service would get no call any longer.
        """
        graph = self._shared.graph
        self._refuse_taken(name, "offered", graph.offering_nodes(name))
        timeout = self._shared.config.service_timeout
        graph.advertise_service(self.owner, name, kind, ask, timeout)

    @staticmethod
    def _refuse_taken(name: str, what: str, nodes: list[str]) -> None:
        reason = taken(name, what, nodes)
        if reason is not None:
            raise GraphError(reason)

    async def _subscribe(self, packet: packets.Subscribe, name: str) -> None:
        """Listen before the graph delivers: a latched message is not missed, in the new form."""
        session = self.session
        fresh = name not in session.subscriptions
        wishes = session.wishes(name, packet)
        if fresh:
            session.subscribed(name, packet)
        self._listen(name, wishes)
        try:
            await self._in_graph(
                self._shared.graph.subscribe, self.owner, name, packet.type, wishes.form
            )
        except Exception:
            if fresh:
                session.unsubscribed(name, UNSET)
                self._stop_listening(name)
            else:
                self._listen(name, session.wishes(name))
            raise
        session.subscribed(name, packet)
        remark = session.remark(packet)
        if remark is not None:
            self.answer(remark)

    def _listen(self, name: str, wishes: Wishes) -> None:
        self._forms[name] = wishes.form
        self.sending.outbox.subscribe(name, wishes.interval, wishes.queue_length)
        self._shared.listeners.setdefault(name, set()).add(self)
        self.sending.flush()  # what waits may be due sooner now

    async def _unsubscribe(self, packet: packets.Unsubscribe, name: str) -> None:
        graph = self._shared.graph
        if self.session.unsubscribed(name, packet.id):
            self._stop_listening(name)
            await self._in_graph(graph.unsubscribe, self.owner, name)
        elif name in self.session.subscriptions:
            wishes = self.session.wishes(name)
            await self._in_graph(graph.change_form, self.owner, name, wishes.form)
            self._listen(name, wishes)

    def _stop_listening(self, name: str) -> None:
        listeners = self._shared.listeners.get(name, set())
        listeners.discard(self)
        if not listeners:
            self._shared.listeners.pop(name, None)
        self.sending.outbox.unsubscribe(name)

    def respond(self, packet: packets.CallService, values: dict[str, Any]) -> None:
        """Answer a call."""
        response = packets.ServiceResponse(
            id=packet.id, service=packet.service, values=values, result=True
        )
        self.answer(response, packet.fragment_size)

    def _refuse(self, request: Request, reason: str) -> None:
        answer = self.session.refuse(request.packet, reason, time.monotonic())
        if answer is not None:
            self.answer(answer)

    def refuse_call(self, packet: packets.CallService, name: str, reason: str) -> None:
        """Answer a call that has failed with the reason."""
        self._refuse(Request(packet, name), reason)
        self._tell_audit()

    def called(self, packet: packets.CallService, name: str, values: dict[str, Any]) -> None:
        """Tell the audit what came of a call."""
        self.session.performed(Request(packet, name), values, time.monotonic())
        self._tell_audit()

    def _tell_audit(self) -> None:
        for entry in self.session.take_entries():
            self._shared.graph.audit(self.caller, entry)

    def answer(self, packet: Packet, fragment_size: int | None = None) -> None:
        """Send an answer, in order with the other answers, in pieces if it was asked for so."""
        self._answers += 1
        size = self.session.fragment_size(fragment_size)
        with self._connection.charged():
            parts = split(packets.encode(packet), size, f"answer:{self._answers}")
        self.sending.answer(Frames(parts))

    def deliver(self, topic: str, message: Message) -> None:
        """Send a message in the form that the client wants, or keep it as the topic's newest."""
        self.sending.message(topic, message.frames(self._forms[topic]))

    @property
    def seat(self) -> Seat:
        """What decides whether the client may keep its place."""
        session = self.session
        held = (
            session.subscriptions or session.advertisements or session.services or len(self._calls)
        )
        return Seat(self.owner, self.visitor, bool(held), self._heard)

    @property
    def is_gone(self) -> bool:
        """Whether its connection has ended, or is about to."""
        return self._gone

    def drop(self, reason: str) -> None:
        """End the connection at once, without waiting for a client that takes nothing."""
        if not self._gone:
            self._gone = True
            self.drop_reason = reason
            self.sending.end()
            self._connection.transport.abort()

    def _leave_graph(self) -> None:
        graph, session = self._shared.graph, self.session
        for leave, names in (
            (graph.unsubscribe, session.subscriptions),
            (graph.unadvertise, session.advertisements),
            (graph.unadvertise_service, session.services),
        ):
            for name in names:
                try:
                    leave(self.owner, name)
                except Exception as error:
                    self._shared.errors += 1
                    self._shared.log(f"error while leaving {name}: {error!r}")
