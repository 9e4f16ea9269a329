"""A process that has loaded what all nodes load, and becomes a node by forking.

Started by :class:`~scara_bringup.processes.forked_io.WarmParent`, as a program of its own or as a
fork of the bring-up. It has no thread, so that a fork is a whole copy. Each node gets a
session, a log and signals of its own, and dies with this process, as this one does with the
bring-up.
"""

from __future__ import annotations

import atexit
import contextlib
import ctypes
import importlib
import io
import json
import os
import runpy
import select
import signal
import socket
import sys
import threading
import traceback
from collections.abc import Sequence
from pathlib import Path

from scara_ros.process.memory_io import keep_for_good

SHARED = (
    "actionlib",
    "asyncio",
    "configparser",
    "control_msgs.msg",
    "diagnostic_msgs.msg",
    "encodings.idna",
    "geometry_msgs.msg",
    "msgspec",
    "numpy",
    "numpy.typing",
    "pymodbus.client",
    "rospy",
    "ruckig",
    "scara_config",
    "scara_control.kinematics.arm_kinematics",
    "scara_control.motion.wiring_node",
    "scara_control.trajectory.goal",
    "scara_description.urdf",
    "scara_msgs.msg",
    "scara_msgs.srv",
    "scara_ros.process.scheduling_io",
    "scara_ros.process.memory_io",
    "scara_ros.diagnostics_node",
    "scara_ros.gate.judge_gate_node",
    "scara_ros.shell.ros_node",
    "scara_ros.services.service_client_node",
    "scara_ros.starting.starting_node",
    "sensor_msgs.msg",
    "std_srvs.srv",
    "trajectory_msgs.msg",
    "visualization_msgs.msg",
)
"""What many nodes import, or what Python loads with the first name of a host and the first log.
What only one needs, it loads itself."""

PAGES = ("scara_ros.page.page_library_io",)
"""What the nodes with a page import besides: half a second of processor time and 30 MB for each."""

PREPARED = (
    "scara_control.dynamics.engine_io:prepare_engines",
    "scara_config.readers:check_files",  # parses them: a node finds what it reads parsed
)
"""``module:function`` of what is made once, for those that will need it."""

MESSAGE = 65536
_LIBC = ctypes.CDLL(None, use_errno=True)
_PR_SET_PDEATHSIG, _PR_SET_NAME = 1, 15
_M_ARENA_MAX = -8


def main() -> None:
    """Serve the socket whose number is the first argument until the other end closes it.

    Between it and the last one, which is room, stand modules to load besides.
    """
    line = socket.socket(fileno=int(sys.argv[1]))
    load(sys.argv[2:-1])
    _serve_alone(line)


def load(besides: Sequence[str] = ()) -> None:
    """Load and make what the nodes share, so that a fork finds it; further modules besides."""
    # A heap for each thread of each node is memory for nothing: the interpreter lets one run.
    _LIBC.mallopt(_M_ARENA_MAX, 1)
    for name in (*SHARED, *besides):
        importlib.import_module(name)
    for place in PREPARED:
        module, _, function = place.partition(":")
        getattr(importlib.import_module(module), function)()
    # No collection in a node shall write to the memory that all of them share.
    keep_for_good()


def split_off(line: socket.socket) -> int:
    """Fork a process that serves ``line``; return its id. To be called without another thread.

    It keeps nothing of this one but what is loaded, the environment and the terminal.
    """
    for stream in (sys.stdout, sys.stderr):
        stream.flush()
    caller = os.getpid()
    pid = os.fork()
    if pid:
        return pid
    try:
        os.setsid()
        signal.signal(signal.SIGINT, signal.default_int_handler)
        _LIBC.prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
        _show("python", ["-m", __name__])
        # It may have died before the kernel was asked to tell of its end.
        if os.getppid() != caller:
            os._exit(1)
        sys.stdout, sys.stderr = sys.__stdout__, sys.__stderr__  # a node hardens its own
        nothing = os.open(os.devnull, os.O_RDONLY)
        os.dup2(nothing, 0)
        kept = line.fileno()
        # The parent's files are not ours: one that stays open here would never end for who reads
        # it.
        os.closerange(3, kept)
        os.closerange(kept + 1, os.sysconf("SC_OPEN_MAX"))
        _serve_alone(line)
    except BaseException:
        traceback.print_exc()
    finally:
        os._exit(0)


def _serve_alone(line: socket.socket) -> None:
    """Serve ``line``; a child that ends ends the waiting for a request."""
    ended, waker = socket.socketpair()
    ended.setblocking(False)
    waker.setblocking(False)
    # The handler does nothing; its byte in the socket wakes the poll, which a handler alone would
    # not.
    signal.signal(signal.SIGCHLD, lambda *_: None)
    signal.set_wakeup_fd(waker.fileno(), warn_on_full_buffer=False)
    serve(line, ended)


def serve(line: socket.socket, ended: socket.socket) -> None:
    """Fork what is asked for and tell what has ended."""
    poll = select.poll()
    poll.register(line, select.POLLIN)
    poll.register(ended, select.POLLIN)
    while True:
        ready = [number for number, _ in poll.poll()]
        if ended.fileno() in ready:
            with contextlib.suppress(BlockingIOError):
                ended.recv(MESSAGE)
            for pid, code in _reaped():
                line.send(json.dumps({"ended": pid, "code": code}).encode())
        if line.fileno() in ready:
            request, files, _, _ = socket.recv_fds(line, MESSAGE, 2)
            if not request:
                return
            # Fork and return the child's id once it has a session of its own, so that signals find
            # it
            words = json.loads(request)
            apart, tell = os.pipe()
            pid = os.fork()
            if pid == 0:
                os.close(apart)
                become(words, files, tell)
            for file in (tell, *files):
                os.close(file)
            # Until then a signal to its group would find nobody.
            os.read(apart, 1)
            os.close(apart)
            line.send(json.dumps({"begun": pid}).encode())


def _reaped() -> list[tuple[int, int]]:
    """Return id and exit code of each child that has ended; negative: the signal."""
    found = []
    with contextlib.suppress(ChildProcessError):
        while True:
            pid, status = os.waitpid(-1, os.WNOHANG)
            if pid == 0:
                break
            found.append((pid, os.waitstatus_to_exitcode(status)))
    return found


def become(words: list[str], files: list[int], tell: int) -> None:
    """Be the program ``words`` with ``files`` as stdout and stderr, and end with it.

    Never returns: what lies below on the stack belongs to the parent.
    """
    code = 1
    try:
        # Have a session of its own, and die with the parent
        os.setsid()
        # A shell starts what runs in the background with SIGINT ignored; the bring-up ends nodes
        # by it.
        signal.signal(signal.SIGINT, signal.default_int_handler)
        _LIBC.prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
        # A parent that has died before the kernel was asked does not hear this.
        signal.signal(signal.SIGPIPE, signal.SIG_DFL)
        os.write(tell, b".")
        signal.signal(signal.SIGPIPE, signal.SIG_IGN)
        # Leave nothing of the parent in the child but what it has loaded
        signal.set_wakeup_fd(-1)
        signal.signal(signal.SIGCHLD, signal.SIG_DFL)
        nothing = os.open(os.devnull, os.O_RDONLY)
        for source, target in ((nothing, 0), (files[0], 1), (files[1], 2)):
            os.dup2(source, target)
        os.closerange(3, os.sysconf("SC_OPEN_MAX"))
        for stream in (sys.stdout, sys.stderr):  # a node that dies takes no line with it
            assert isinstance(stream, io.TextIOWrapper)
            stream.reconfigure(write_through=True, line_buffering=True)
        sys.argv, sys.path[0] = words, str(Path(words[0]).resolve().parent)
        importlib.import_module("rospy.names").reload_mappings(words)  # it has read the parent's
        _show(Path(words[0]).name, words)
        runpy.run_path(words[0], run_name="__main__")
        code = 0
    except SystemExit as end:
        code = _exit_code(end)
    except KeyboardInterrupt:
        traceback.print_exc()
        code = 128 + signal.SIGINT
    except BaseException:
        traceback.print_exc()
    finally:
        # As the interpreter ends a program; what the parent has on its stack is not unwound.
        with contextlib.suppress(BaseException):
            threading._shutdown()  # type: ignore[attr-defined]
            atexit._run_exitfuncs()
            sys.stdout.flush()
            sys.stderr.flush()
        os._exit(code)


def _show(name: str, words: list[str]) -> None:
    """Let ps and /proc show a name and a command line, as far as there is room for it."""
    _LIBC.prctl(_PR_SET_NAME, name.encode()[:15], 0, 0, 0)
    # Fields 48 and 49 of proc(5): between them the kernel finds the command line.
    fields = Path("/proc/self/stat").read_text().rpartition(")")[2].split()
    begin, end = int(fields[45]), int(fields[46])
    shown = b"".join(word.encode() + b"\0" for word in (sys.executable, *words))
    ctypes.memmove(begin, shown[: end - begin - 1].ljust(end - begin, b"\0"), end - begin)


def _exit_code(end: SystemExit) -> int:
    """Return the exit code of ``sys.exit``; a text is printed, as the interpreter does."""
    if end.code is None:
        return 0
    if isinstance(end.code, int):
        return end.code & 0xFF
    print(end.code, file=sys.stderr)
    return 1


if __name__ == "__main__":
    main()
