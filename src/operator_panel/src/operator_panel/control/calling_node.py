"""Calls of ROS services for the page, without blocking its event loop."""

from __future__ import annotations

import asyncio
from typing import Any

import rospy
from nicegui import run
from scara_ros.services.service_client_node import ServiceClient
from scara_ros.services.service_connection_io import ServiceError, ServiceTimeoutError

from operator_panel.door import Answer


class Lane:
    """One service, one call at a time, over a connection that stays open.

    A call that is not answered in time is given up by closing its connection; the next call opens
    another.
    """

    def __init__(self, name: str, kind: type, timeout: float) -> None:
        """Remember the service; nothing is called yet."""
        self._name, self._timeout = name, timeout
        self._lock = asyncio.Lock()
        self._client = ServiceClient(name, kind, timeout, keep=True)

    async def call(self, **fields: Any) -> Any:
        """Return the service's response, or an Answer that says why there is none."""
        # One connection carries one call: the answer to another would be taken for its own.
        async with self._lock:
            # The page is served before a master runs: until then nothing can be called from here.
            if not rospy.core.is_initialized():
                return Answer(False, "no ROS master answers")
            try:
                response = await run.io_bound(lambda: self._client(**fields))
            except ServiceTimeoutError:
                return Answer(
                    False,
                    f"{self._name} did not answer within {self._timeout:g} s: it may still be done",
                    lost=True,
                )
            except (ServiceError, rospy.ROSException, OSError) as error:
                return Answer(False, f"{self._name} cannot be called: {error}")
        if response is None:  # nicegui swallows the cancellation of a call
            return Answer(False, f"{self._name} was given up: the page's server ends")
        return response


def as_answer(response: Any, *values: str) -> Answer:
    """Turn a response with success and message into an Answer with the named further fields."""
    if isinstance(response, Answer):
        return response
    return Answer(
        response.success, response.message, {name: getattr(response, name) for name in values}
    )
