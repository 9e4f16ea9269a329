"""Gateways with a stand-in for the ROS graph."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import msgspec
import pytest
from harness.opponents.graph_and_clients import SHIPPED, Cell, MakeCell

PATIENT = {
    "port": 0,
    "driving": msgspec.structs.replace(SHIPPED.driving, ping_interval=60.0, ping_timeout=60.0),
    "handshake_timeout": 60.0,
}


@pytest.fixture
def make_cell() -> Iterator[MakeCell]:
    """Start gateways with changed settings."""
    cells: list[Cell] = []

    def make(
        limits: dict[str, Any] | None = None,
        takes: dict[str, Any] | None = None,
        page_takes: dict[str, Any] | None = None,
        **changes: Any,
    ) -> Cell:
        config = msgspec.structs.replace(SHIPPED, **{**PATIENT, **changes})
        replace = msgspec.structs.replace
        roles = {
            name: replace(role, takes=replace(role.takes, **((takes or {}) | more)))
            for name, role in config.roles.items()
            for more in ((page_takes or {}) if name == config.page_role else {},)
        }
        config = replace(config, roles=roles)
        config = msgspec.structs.replace(
            config, limits=msgspec.structs.replace(config.limits, **(limits or {}))
        )
        cells.append(Cell(config))
        cells[-1].server.start()
        return cells[-1]

    yield make
    for cell in cells:
        cell.close()


@pytest.fixture
def cell(make_cell: MakeCell) -> Cell:
    """Return a running gateway."""
    return make_cell()
