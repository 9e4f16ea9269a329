"""Service calls that can be waited for, and one connection for many."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

import rospy


class Call:
    """A service call in a thread of its own, so that its caller can look around while it lasts."""

    def __init__(self, call: Callable[[], Any]) -> None:
        """Begin the call."""
        self.ended = threading.Event()
        self._call = call
        self._answer: Any = None
        self._error: Exception | None = None
        threading.Thread(target=self._run, daemon=True).start()

    def _run(self) -> None:
        try:
            self._answer = self._call()
        except Exception as error:
            self._error = error
        self.ended.set()

    def result(self) -> Any:
        """Return the answer or raise what the call raised."""
        if self._error is not None:
            raise self._error
        return self._answer


class PersistentService:
    """A service called through one connection, which is opened again when it broke."""

    def __init__(self, name: str, kind: type[Any], timeout: float) -> None:
        """Connect at the first call; ``timeout`` [s] is how long a call waits for the service to be there."""
        self._name, self._kind, self._timeout = name, kind, timeout
        self._lock = threading.Lock()
        self._proxy: rospy.ServiceProxy | None = None

    def __call__(self, **fields: Any) -> Any:
        """Call; a broken connection is tried once more."""
        with self._lock:
            if self._proxy is not None:
                try:
                    return self._proxy(**fields)
                except rospy.ServiceException:
                    self._proxy.close()
            rospy.wait_for_service(self._name, self._timeout)
            self._proxy = rospy.ServiceProxy(self._name, self._kind, persistent=True)
            return self._proxy(**fields)
