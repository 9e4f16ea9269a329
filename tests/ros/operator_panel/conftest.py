"""What the tests of the operator panel share: a panel that hears a stand-in of the controller."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from harness.page.stand_in import StandIn, in_control
from harness.page.theatre import Theatre, kept_theatre
from harness.processes import wait_until
from harness.ros import Ros
from harness.wires.operator_page import Panel, heard
from harness.yaml_files import changed_yaml, copy_configuration
from websockets.sync.client import ClientConnection


@pytest.fixture(scope="module")
def stand_in(ros_module: Ros) -> Iterator[StandIn]:
    """Give a twin controller."""
    made = StandIn(ros_module)
    yield made
    made.close()


@pytest.fixture(scope="module")
def panel(ros_module: Ros, stand_in: StandIn) -> Panel:
    """Give a panel that hears the twin controller."""
    folder = copy_configuration(ros_module.folder / "config")
    # A page gives its first sign of life within a fifth of it.
    changed_yaml(folder / "twin_controller.yaml", folder, ["control", "keep_ms"], 1000.0)
    made = Panel(ros_module, f"_config_dir:={folder}")
    with made.live() as live:
        wait_until(
            lambda: heard(live, "frame")["text"]["mode"] == "Ready", 20.0, "a state on the page"
        )
    return made


@pytest.fixture
def operator(panel: Panel, stand_in: StandIn) -> Iterator[ClientConnection]:
    """Give the live connection of an operator in control."""
    with in_control(panel, stand_in) as live:
        yield live


@pytest.fixture(scope="module")
def theatre() -> Iterator[Theatre]:
    """Give one page of a stage for all tests of a file; its browser cannot draw the model."""
    with kept_theatre() as made:
        yield made
