"""Calls of ROS services that end: rospy itself knows no time-out."""

from __future__ import annotations

import asyncio
from typing import Any

import rospy
from nicegui import run

from operator_panel.door import Answer


class Lane:
    """One service, one call at a time, over a connection that stays open.

    A call that is not answered in time is given up by closing its connection; the next call opens another.
    """

    def __init__(self, name: str, kind: type, timeout: float) -> None:
        """Remember the service; nothing is called yet."""
        self._name, self._kind, self._timeout = name, kind, timeout
        self._lock = asyncio.Lock()
        self._proxy: Any = None

    async def call(self, **fields: Any) -> Any:
        """Return the service's response, or an Answer that says why there is none."""
        async with self._lock:
            if not rospy.core.is_initialized():
                return Answer(False, "no ROS master answers")
            try:
                return await asyncio.wait_for(run.io_bound(self._call, fields), self._timeout)
            except TimeoutError:
                self._drop()
                return Answer(False, f"{self._name} did not answer within {self._timeout:g} s: it may still be done")
            except (rospy.ServiceException, rospy.ROSException, OSError) as error:
                self._drop()
                return Answer(False, f"{self._name} cannot be called: {error}")

    def _call(self, fields: dict[str, Any]) -> Any:
        if self._proxy is None:
            self._proxy = rospy.ServiceProxy(self._name, self._kind, persistent=True)
        try:
            return self._proxy(**fields)
        except rospy.ServiceException:
            # A service that was started again has closed the old connection: once more over a new one.
            self._drop()
            self._proxy = rospy.ServiceProxy(self._name, self._kind, persistent=True)
            return self._proxy(**fields)

    def _drop(self) -> None:
        proxy, self._proxy = self._proxy, None
        if proxy is not None:
            proxy.close()


def as_answer(response: Any, *values: str) -> Answer:
    """Turn a response with success and message into an Answer with the named further fields."""
    if isinstance(response, Answer):
        return response
    return Answer(response.success, response.message, {name: getattr(response, name) for name in values})
