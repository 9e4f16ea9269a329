"""STOP and E-STOP on connections of their own, whatever the master and the rest of the page do.

A keeper opens a connection to the twin controller's command service at the start and a fresh one
each second: that is its test. Each press has a thread of its own and takes the open connection,
so no press waits for a pool, for another command, or for the press before it.
"""

from __future__ import annotations

import io
import threading
import time
from collections import Counter
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any

from scara_ros.services.service_connection_io import (
    ServiceConnection,
    ServiceError,
    ServiceTimeoutError,
)

from operator_panel.door import Answer

ANSWER_S = 0.4  # our choice: the page waits 0.5 s; the rest is for the way to the browser and back
TEST_PERIOD_S = 1.0  # our choice: how old the last test of the connection may be
TEST_TIMEOUT_S = 1.0  # our choice: a controller that needs longer for a greeting is not well
UNTESTED_S = 4 * (TEST_PERIOD_S + TEST_TIMEOUT_S)  # our choice: then the keeper itself hangs
LATE_S = 20.0  # our choice: how long an answer that is late is still told to the page
MOST_WAITING = 8  # our choice: so many unanswered presses of a command; each has a thread

Find = Callable[[], tuple[str, str]]


class StopLine:
    """Sends STOP and ESTOP; safe to use from several threads."""

    def __init__(self, kind: Any, caller: str, find: Find, period: float = TEST_PERIOD_S) -> None:
        """Remember how to reach the service; :meth:`keep` connects.

        Args:
            kind: The service's class; its request has ``command``.
            caller: Name of this node.
            find: Asks the master for the service's absolute name and ``rosrpc://`` address;
                raises ServiceError if that cannot be told. It must have a deadline.
            period: Between two tests [s].
        """
        self._kind, self._caller, self._find, self._period = kind, caller, find, period
        self._lock = threading.Lock()
        # Open and tested, for the next press; that takes it away and wakes the keeper.
        self._ready: ServiceConnection | None = None
        # Where the service was last: a STOP then needs no master.
        self._address: tuple[str, str] | None = None
        self._trouble = "no twin controller has been found yet"
        self._tested = time.monotonic()
        # By command, the presses without an answer: each has a thread.
        self._waiting: Counter[str] = Counter()
        self._wake = threading.Event()

    def keep(self, ended: threading.Event) -> None:
        """Keep a tested connection until ``ended``; runs in a thread of its own."""
        while not ended.is_set():
            # Open a fresh connection; an old one stays while none can be had
            try:
                fresh = self._fresh()
            except ServiceError as error:
                self._trouble = str(error)
            else:
                self._put(fresh)
                self._trouble = ""
            self._tested = time.monotonic()
            # A press that took the connection wakes the keeper, so that the next finds one too.
            self._wake.wait(self._period)
            self._wake.clear()
        self._put(None)

    def trouble(self) -> str:
        """Return why a STOP would not get through now, or an empty text."""
        if self._trouble:
            return self._trouble
        untested = time.monotonic() - self._tested
        if untested > UNTESTED_S:
            return f"the connection was not tested for {untested:.0f} s"
        return ""

    def send(self, command: str, **who: str) -> Future[Answer]:
        """Send ``command`` at once; the answer may come late, and always comes.

        Args:
            command: STOP or ESTOP.
            who: Further fields of the request, which say who pressed; nothing depends on them.

        Raises:
            RuntimeError: The machine gives no thread.
        """
        answer: Future[Answer] = Future()
        answer.set_running_or_notify_cancel()  # who no longer waits does not take the STOP back
        with self._lock:
            if self._waiting[command] >= MOST_WAITING:
                text = f"{MOST_WAITING} that were sent before are not answered yet"
                answer.set_result(not_confirmed(text))
                return answer
            self._waiting[command] += 1
        try:
            threading.Thread(
                target=self._press, args=(command, answer, who), name=command, daemon=True
            ).start()
        except RuntimeError:
            self._answered(command)
            raise
        return answer

    def _press(self, command: str, answer: Future[Answer], who: dict[str, str]) -> None:
        begun = time.monotonic()
        try:
            response = self._send(command, who)
        except ServiceTimeoutError as error:
            answer.set_result(not_confirmed(str(error)))
        except ServiceError as error:
            answer.set_result(not_confirmed(f"it could not be sent: {error}"))
        except Exception as error:
            answer.set_exception(error)
        else:
            late = time.monotonic() - begun
            words = response.message + (f" (after {late:.1f} s)" if late > ANSWER_S else "")
            answer.set_result(Answer(response.sent, words, {"confirmed": True}))
        finally:
            self._answered(command)

    def _answered(self, command: str) -> None:
        with self._lock:
            self._waiting[command] -= 1

    def _send(self, command: str, who: dict[str, str]) -> Any:
        """Send over the open connection; where that broke, over new ones: a STOP may come twice."""
        buffer = io.BytesIO()
        # The page shows by itself when both stand.
        self._kind._request_class(command=command, at_once=True, **who).serialize(buffer)
        payload = buffer.getvalue()
        failure = ServiceError("no way was tried")
        for connect in (self._take, self._again, self._anew):
            try:
                connection = connect()
                try:
                    response = self._kind._response_class()
                    response.deserialize(connection.call(payload, LATE_S))
                except BaseException:
                    connection.close()
                    raise
                # It goes back after a whole answer only, so that nothing of this one is left for
                # the next STOP.
                with self._lock:
                    if self._ready is None:
                        connection, self._ready = None, connection  # type: ignore[assignment]
                if connection is not None:
                    connection.close()
                return response
            except ServiceTimeoutError:
                raise
            except ServiceError as error:
                failure = error
        raise failure

    def _take(self) -> ServiceConnection:
        """Take the open connection and let the keeper open the next one."""
        with self._lock:
            connection, self._ready = self._ready, None
        self._wake.set()
        if connection is None:
            raise ServiceError("no connection is open")
        return connection

    def _again(self) -> ServiceConnection:
        """Connect where the service was last; no master is asked."""
        if self._address is None:
            raise ServiceError("no twin controller has been found yet")
        return self._connect(self._address)

    def _anew(self) -> ServiceConnection:
        """Connect where the service is now."""
        self._address = self._find()
        return self._connect(self._address)

    def _fresh(self) -> ServiceConnection:
        """Connect where the service was last; ask the master only if it is not there."""
        if self._address is None:
            return self._anew()
        try:
            return self._again()
        except ServiceError as error:
            # A connection to where the service is now
            try:
                address = self._find()
            except ServiceError:
                raise error from None
            if address == self._address:
                raise error
            self._address = address
            return self._connect(address)

    def _connect(self, address: tuple[str, str]) -> ServiceConnection:
        service, uri = address
        md5sum = self._kind._md5sum
        return ServiceConnection(service, uri, self._caller, TEST_TIMEOUT_S, md5sum, keep=True)

    def _put(self, connection: ServiceConnection | None) -> None:
        with self._lock:
            before, self._ready = self._ready, connection
        if before is not None:
            before.close()


def not_confirmed(why: str) -> Answer:
    """Return the answer to a press of which nobody knows whether it was obeyed."""
    return Answer(False, why, {"confirmed": False}, lost=True)
