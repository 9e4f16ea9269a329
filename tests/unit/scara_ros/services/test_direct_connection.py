"""A publisher's line: sent at once, never waiting, whole to the byte, the newest kept."""

from __future__ import annotations

import socket
import threading
from collections.abc import Iterator
from typing import Any

import pytest
from scara_ros.services.direct_connection_io import DirectConnection

MESSAGE = 1000


class Line:
    """What rospy gives: a blocking socket with the figures of what was sent."""

    def __init__(self, end: socket.socket) -> None:
        self.socket: socket.socket | None = end
        self.done = False
        self.stat_bytes = self.stat_num_msg = 0
        self.endpoint_id = "listener"

    def write_data(self, data: bytes) -> bool:
        """Send all of it, however long that takes."""
        if self.done or self.socket is None:
            raise ConnectionError("connection closed")
        self.socket.sendall(data)
        self.stat_bytes += len(data)
        self.stat_num_msg += 1
        return True


@pytest.fixture
def ends() -> Iterator[tuple[socket.socket, socket.socket]]:
    """Both ends of a line, with small buffers."""
    near, far = socket.socketpair()
    near.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 4096)
    # rosnode, once another test has used it, gives each new socket of the process a limit.
    near.settimeout(None)
    with near, far:
        far.settimeout(10.0)
        yield near, far


def message(number: int) -> bytes:
    """A message of its own number."""
    return number.to_bytes(4, "big") * (MESSAGE // 4)


def backlogs() -> list[threading.Thread]:
    """Threads that send what waits."""
    return [thread for thread in threading.enumerate() if thread.name == "backlog"]


def read(far: socket.socket, count: int) -> list[int]:
    """The numbers of the next ``count`` messages; each must be whole."""
    found = []
    for _ in range(count):
        data = b""
        while len(data) < MESSAGE:
            data += far.recv(MESSAGE - len(data))
        found.append(int.from_bytes(data[:4], "big"))
        assert data == message(found[-1])
    return found


def test_listener_that_keeps_up_needs_no_thread(ends: tuple[Any, Any]) -> None:
    """Each message is there when write_data returns."""
    near, far = ends
    line = Line(near)
    direct = DirectConnection(line, 2)
    for number in range(50):
        assert direct.write_data(message(number))
        assert not backlogs()
        far.setblocking(False)
        assert far.recv(2 * MESSAGE) == message(number)
        far.setblocking(True)
    assert (line.stat_num_msg, line.stat_bytes) == (50, 50 * MESSAGE)


def test_listener_that_stands_still_holds_nobody_up(ends: tuple[Any, Any]) -> None:
    """What it has begun comes whole, of what waits the newest; then no thread is needed again."""
    near, far = ends
    direct = DirectConnection(Line(near), 3)
    for number in range(1000):
        direct.write_data(message(number))
    (sender,) = backlogs()
    taken = 0
    found: list[int] = []
    while not found or found[-1] != 999:
        found += read(far, 1)
        taken += 1
    assert found == sorted(found), "the order is kept"
    assert found[-3:] == [997, 998, 999], "the newest are kept"
    assert taken < 1000, "some had to be dropped, or nothing was tested"
    sender.join(10.0)
    assert not backlogs()
    direct.write_data(message(7))
    assert read(far, 1) == [7]
    assert not backlogs()


def test_without_a_limit_nothing_is_dropped(ends: tuple[Any, Any]) -> None:
    """Queue size 0: any number waits."""
    near, far = ends
    direct = DirectConnection(Line(near), 0)
    for number in range(300):
        direct.write_data(message(number))
    assert read(far, 300) == list(range(300))


def test_listener_that_is_gone_is_told_at_once(ends: tuple[Any, Any]) -> None:
    """As rospy's own line does: an error, upon which rospy drops the line."""
    near, far = ends
    direct = DirectConnection(Line(near), 3)
    far.close()
    with pytest.raises(OSError):
        direct.write_data(message(1))


def test_listener_that_goes_while_something_waits_is_told_with_the_next(
    ends: tuple[Any, Any],
) -> None:
    """The thread's error reaches the publisher."""
    near, far = ends
    direct = DirectConnection(Line(near), 3)
    while not backlogs():
        direct.write_data(message(1))
    (sender,) = backlogs()
    far.close()
    sender.join(10.0)
    with pytest.raises(OSError):
        direct.write_data(message(2))


def test_line_that_was_closed_says_so(ends: tuple[Any, Any]) -> None:
    """In rospy's own words."""
    near, _ = ends
    line = Line(near)
    direct = DirectConnection(line, 3)
    line.done = True
    with pytest.raises(ConnectionError, match="connection closed"):
        direct.write_data(message(1))
    assert direct.endpoint_id == "listener"
