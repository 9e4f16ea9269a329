"""A gateway for the tests of a module."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from harness.opponents.running_gateway import RunningGateway
from harness.ros import Ros


@pytest.fixture(scope="module")
def running(ros_module: Ros) -> RunningGateway:
    """Start one gateway for the tests of a module."""
    return RunningGateway(ros_module)


@pytest.fixture
def gateway(running: RunningGateway) -> Iterator[RunningGateway]:
    """Give a test the gateway; its clients go at the end."""
    yield running
    running.end_clients()
