"""One ROS master for a pytest run, one namespace for each test."""

from __future__ import annotations

import itertools
import os
import threading
import time
import xmlrpc.client
from collections.abc import Callable, Iterator, MutableSequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

from harness.processes import Process, Stage, free_port, wait_until
from harness.workspace import workspace_environment

T = TypeVar("T")

_NUMBERS = itertools.count(1)
QUEUE = 1000
"""Messages that rospy holds per connection: its thread may stand while a test's own one goes on,
and what a test has published must arrive."""


class Master:
    """A ROS master on a free port of 127.0.0.1, and this test process as a node of it."""

    def __init__(self, folder: Path, env: dict[str, str]) -> None:
        """Start the master and wait until it answers."""
        self.uri = f"http://127.0.0.1:{free_port()}"
        ros_home = folder / "ros_home"
        ros_home.mkdir(parents=True, exist_ok=True)
        self.env = {
            **env,
            "ROS_MASTER_URI": self.uri,
            "ROS_HOME": str(ros_home),
            "ROS_LOG_DIR": str(ros_home / "log"),
        }
        self.stage = Stage(folder, self.env)
        self.process = self.stage.start("rosmaster", "--core", "-p", self.uri.rsplit(":", 1)[1])
        wait_until(self.answers, 15.0, f"the ROS master at {self.uri}")

    def answers(self) -> bool:
        """Say whether the master answers."""
        assert self.process.poll() is None, f"rosmaster ended:\n{self.process.tail()}"
        try:
            answer: Any = xmlrpc.client.ServerProxy(self.uri).getPid("/tests")
            return bool(answer[0] == 1)
        except OSError:
            return False

    def close(self) -> None:
        """End the master."""
        self.stage.close()


@contextmanager
def own_master(folder: Path, name: str) -> Iterator[Master]:
    """Give a ROS master for the whole process, which becomes its node ``name``."""
    import rospy

    master = Master(folder, workspace_environment())
    kept = ("ROS_MASTER_URI", "ROS_HOME", "ROS_LOG_DIR")
    os.environ.update({each: master.env[each] for each in kept})
    rospy.init_node(name, disable_signals=True)
    try:
        yield master
    finally:
        rospy.signal_shutdown(f"{name} has ended")
        master.close()


class Ros:
    """What the fixture ``ros`` gives to a test. See tests/ros/conftest.py for an example."""

    def __init__(self, master: Master, folder: Path, label: str) -> None:
        """Make a namespace of its own; ``label`` appears in it."""
        self.master = master
        self.namespace = (
            f"/t{next(_NUMBERS)}_{''.join(c if c.isalnum() else '_' for c in label)[:40]}"
        )
        self.folder = folder
        self.stage = Stage(folder / "processes", {**master.env, "ROS_NAMESPACE": self.namespace})
        self.env = self.stage.env
        self._handles: list[Any] = []

    free_port = staticmethod(free_port)
    wait_until = staticmethod(wait_until)

    def name(self, relative: str) -> str:
        """Resolve a relative name into the test's namespace; an absolute name stays as it is."""
        return relative if relative.startswith("/") else f"{self.namespace}/{relative}"

    def frame(self, plain: str) -> str:
        """Return a tf frame as the nodes in the test's namespace call it."""
        return self.name(plain)[1:]

    def run(
        self, package: str, node: str, *args: str, env: dict[str, str] | None = None
    ) -> Process:
        """Start ``rosrun package node args`` in the test's namespace."""
        return self.stage.start("rosrun", package, node, *map(str, args), name=node, env=env)

    def shell(self, *command: str, timeout: float = 20.0) -> str:
        """Run a command line tool (``rosservice``, ``rosbag``) to its end and return its output.

        Fail if it fails.
        """
        return self.stage.tool(*command, timeout=timeout)

    def service(self, name: str, kind: type[Any], timeout: float = 20.0) -> Callable[..., Any]:
        """Return a call of a service that ends after ``timeout`` [s].

        rospy's own would wait for ever. A request says when it was asked for, unless ``asked`` is
        given.
        """
        self.wait_for_service(name, timeout)
        import rospy

        proxy = rospy.ServiceProxy(self.name(name), kind)

        def call(*args: Any, within: float = timeout, **fields: Any) -> Any:
            names = kind._request_class.__slots__
            fields |= dict(zip(names, args))
            if "asked" in names:
                fields.setdefault("asked", time.monotonic())  # as our own clients do
            return with_deadline(lambda: proxy(**fields), within, f"answer of {name}")

        return call

    def wait_for_service(self, name: str, timeout: float = 20.0) -> None:
        """Wait until a service answers to its name; fail at once when a started node has died."""
        import rospy

        master = rospy.get_master()

        def there() -> bool:
            self._all_alive()
            # rospy would look each 0.3 s.
            if master.lookupService(self.name(name))[0] != 1:
                return False
            try:
                rospy.wait_for_service(self.name(name), timeout=0.2)
            except rospy.ROSException:
                return False
            return True

        wait_until(there, timeout, f"service {self.name(name)}")

    def wait_for_message(
        self,
        topic: str,
        kind: type[T],
        timeout: float = 20.0,
        such_that: Callable[[T], bool] | None = None,
    ) -> T:
        """Return the next message on ``topic`` (the next for which ``such_that`` is true)."""
        received = self.collect(topic, kind)

        def found() -> list[T]:
            self._all_alive()
            return [m for m in list(received) if such_that is None or such_that(m)][:1]

        what = f"a message on {self.name(topic)}, {len(received)} seen"
        return wait_until(found, timeout, what)[0]

    def collect(
        self,
        topic: str,
        kind: type[T],
        received: MutableSequence[T] | None = None,
        publishers: int = 0,
    ) -> MutableSequence[T]:
        """Return a list that grows with each message on ``topic``, once so many nodes publish it.

        It is ``received``, or a new one.
        """
        import rospy

        received = [] if received is None else received
        options = {"queue_size": QUEUE, "tcp_nodelay": True}
        subscriber = rospy.Subscriber(self.name(topic), kind, received.append, **options)
        self._handles.append(subscriber)

        def connected() -> bool:
            self._all_alive()
            return bool(subscriber.get_num_connections() >= publishers)

        if publishers:
            wait_until(connected, 60.0, f"a publisher of {self.name(topic)}")
        return received

    def publisher(
        self,
        topic: str,
        kind: type[Any],
        subscribers: int = 1,
        timeout: float = 20.0,
        **options: Any,
    ) -> Any:
        """Return a publisher once ``subscribers`` nodes listen to it."""
        import rospy

        publisher = rospy.Publisher(
            self.name(topic), kind, **{"queue_size": QUEUE, "tcp_nodelay": True, **options}
        )
        self._handles.append(publisher)
        wait_until(
            lambda: publisher.get_num_connections() >= subscribers,
            timeout,
            f"a listener on {self.name(topic)}",
        )
        return publisher

    def set_param(self, name: str, value: Any) -> None:
        """Set a parameter in the test's namespace."""
        import rospy

        rospy.set_param(self.name(name), value)

    def close(self) -> None:
        """Leave all topics, end all processes, forget /use_sim_time."""
        import rospy

        for handle in self._handles:
            handle.unregister()
        if rospy.has_param("/use_sim_time"):
            rospy.delete_param("/use_sim_time")
        self.stage.close()

    def _all_alive(self) -> None:
        """Fail with the log of a process that has ended with an error while somebody waits."""
        for process in self.stage.processes:
            assert process.poll() in (None, 0), (
                f"{process} ended with {process.poll()}:\n{process.tail()}"
            )


def with_deadline(action: Callable[[], T], timeout: float, what: str) -> T:
    """Run ``action`` in a thread and hand on its answer or error, or fail after ``timeout`` [s]."""
    outcome: list[tuple[str, Any]] = []

    def work() -> None:
        try:
            outcome.append(("answer", action()))
        except BaseException as error:
            outcome.append(("error", error))

    thread = threading.Thread(target=work, daemon=True)
    thread.start()
    thread.join(timeout)
    assert outcome, f"waited {timeout:g} s in vain for the {what}"
    kind, value = outcome[0]
    if kind == "error":
        raise value
    answer: T = value
    return answer
