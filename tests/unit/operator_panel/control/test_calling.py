"""A call of the page always ends in an answer, also where nicegui hides why it ended."""

from __future__ import annotations

import asyncio
import threading

import pytest
import rospy
from operator_panel.control.calling_node import Lane
from scara_ros.services.service_client_node import ServiceClient
from std_srvs.srv import Trigger


def test_cancelled_call_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nicegui turns the cancellation of a waiting call into None."""
    begun, free = threading.Event(), threading.Event()

    def hang(_: ServiceClient, **__: object) -> None:
        begun.set()
        free.wait(10.0)

    monkeypatch.setattr(rospy.core, "is_initialized", lambda: True)
    monkeypatch.setattr(ServiceClient, "__call__", hang)

    async def scene() -> object:
        call = asyncio.create_task(Lane("shadow", Trigger, 3.0).call())
        await asyncio.to_thread(begun.wait, 10.0)
        call.cancel()
        try:
            return await call
        finally:
            free.set()

    answer = asyncio.run(scene())
    assert getattr(answer, "message", "") == "shadow was given up: the page's server ends"
