"""Become a ROS node: wait for the master, end by a signal, stay registered."""

from __future__ import annotations

import atexit
import contextlib
import select
import signal
import socket
import sys
import threading
from collections.abc import Iterator

import rosgraph
import rospy
import rospy.topics

from scara_ros.services.direct_connection_io import DirectConnection
from scara_ros.starting.master_io import UNREACHABLE, MasterClient, MasterError
from scara_ros.starting.registration_node import keep_registered
from scara_ros.starting.xmlrpc_guard_io import harden_process

RETRY_S = 0.5
ENDING_S = 5.0
SIGNALS = (signal.SIGINT, signal.SIGTERM)
THE_END = 0
"""Stands for the number of a signal."""
SWITCH_S = 0.0005
"""A thread that computes lets the others run after so long [s]; our choice: a tenth of Python's.

rospy has a thread for each listener. With five of them busy, a control loop waited for 25 ms.
"""


def become_node(name: str) -> None:
    """Become the node ``name`` once there is a master; to be called once, in the main thread.

    SIGINT or SIGTERM ends the waiting, later the node: ``rospy.is_shutdown`` is true then and
    ``wait_for_end`` returns. The shutdown runs in a thread of its own. rospy's own handler runs it
    inside the interrupted thread. If that one was publishing and held the lock of a connection,
    the shutdown waited for that lock for ever.

    The node outlives a full log disk and takes nothing from web pages: ``harden_process``.

    Raises:
        SystemExit: A signal came before there was a master, code 0; or see ``refuse_second_node``.
    """
    received, writer = socket.socketpair()
    writer.setblocking(False)
    harden_process()
    sys.setswitchinterval(SWITCH_S)
    send_directly()
    # The signal's number is written as it comes. A handler runs in the main thread, and later: for
    # ever later, if the signal came just before that thread began to wait for the end.
    signal.set_wakeup_fd(writer.fileno())
    for number in SIGNALS:
        signal.signal(number, lambda *_: None)
    # Say once that the master is missing, and wait
    told = False
    while not master_answers(name):
        if not told:
            print(
                f"{name}: no roscore at {rosgraph.get_master_uri()}: waiting for it",
                file=sys.stderr,
                flush=True,
            )
            told = True
        if select.select([received], [], [], RETRY_S)[0] and received.recv(1)[0] in SIGNALS:
            sys.exit(0)
    refuse_second_node(name)
    rospy.init_node(name, disable_signals=True)
    ending = threading.Thread(target=_end_with, args=(received,), name="ending", daemon=True)
    ending.start()
    atexit.register(_finish, received, writer, ending)
    keep_registered()


def refuse_second_node(name: str) -> None:
    """End this program with one line if a node of this name runs already.

    The master would end that one in its place, and with it the cell that it belongs to. Without a
    master nothing is said, nor about a node that was killed: the master still knows it, but it does
    not answer.

    Args:
        name: Without ``__name:=``, which counts before it.

    Raises:
        SystemExit: It runs; the code is 1.
    """
    base = rosgraph.names.load_mappings(sys.argv).get("__name", name)
    own = rosgraph.names.make_caller_id(base).rstrip("/")
    try:
        uri = MasterClient(rosgraph.get_master_uri(), own).ask("lookupNode", own)
        pid = MasterClient(uri, own).ask("getPid")
    except (*UNREACHABLE, MasterError):
        return
    print(
        f"{name}: {own} runs already, as process {pid}: end it first, or give this one another "
        f"name with __name:={base}_2",
        file=sys.stderr,
    )
    sys.exit(1)


def send_directly() -> None:
    """Let publishers send in the thread that publishes; call before the first one is made."""
    rospy.topics.QueuedConnection = DirectConnection


@contextlib.contextmanager
def until_shutdown() -> Iterator[None]:
    """Run a node's loop; end it when it publishes while the node shuts down: topics are gone."""
    try:
        yield
    except rospy.ROSException:
        if not rospy.core.is_shutdown_requested():  # topics are closed before is_shutdown is true
            raise


def master_answers(caller: str) -> bool:
    """Return whether a ROS master answers; one that hangs is given up after a second."""
    try:
        MasterClient(rosgraph.get_master_uri(), caller).ask("getPid")
    except (*UNREACHABLE, MasterError):
        return False
    return True


def _end_with(received: socket.socket) -> None:
    """Shut the node down when a signal, or the end of the program, has come."""
    number = received.recv(1)[0]
    while number not in (*SIGNALS, THE_END):  # others may be handled in the program
        number = received.recv(1)[0]
    rospy.signal_shutdown(f"signal {number}" if number else "the program has ended")


def _finish(_received: socket.socket, writer: socket.socket, ending: threading.Thread) -> None:
    """Let the shutdown come to its end before the interpreter goes.

    The socket that is read is held until then: behind a signal nobody reads it any more.
    """
    signal.set_wakeup_fd(-1)
    writer.send(bytes([THE_END]))
    ending.join(ENDING_S)
