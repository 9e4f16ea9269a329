"""The tuning form in a real browser: its fields show the gains in force, whatever comes late."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest
from harness.processes import Process, free_port, wait_until
from harness.ros import Ros
from harness.wires.browser import kept_chromium
from harness.wires.operator_page import TOKEN, VARIABLE
from playwright.sync_api import Page, WebSocketRoute, expect

JOINT = "joint_1"


class Tuner:
    """The simulator's tuning server of one joint, one topic at a time."""

    def __init__(self, ros: Ros) -> None:
        """Advertise as the simulator does."""
        import rospy
        from dynamic_reconfigure.msg import Config, ConfigDescription

        place = f"twin/pid/{JOINT}"
        self._ranges = rospy.Publisher(
            ros.name(f"{place}/parameter_descriptions"),
            ConfigDescription,
            queue_size=10,
            latch=True,
        )
        self._values = rospy.Publisher(
            ros.name(f"{place}/parameter_updates"), Config, queue_size=10, latch=True
        )

    def tell_range(self, highest: float) -> None:
        """Publish the range of the gain."""
        from dynamic_reconfigure.msg import ConfigDescription

        self._ranges.publish(ConfigDescription(min=_config(0.0), max=_config(highest)))

    def tell_value(self, value: float) -> None:
        """Publish the gain in force."""
        self._values.publish(_config(value))


def _config(value: float) -> Any:
    from dynamic_reconfigure.msg import Config, DoubleParameter

    return Config(doubles=[DoubleParameter("position_d", value)])


class LateBrowser:
    """What the page's fields send can be held back, as on a busy machine."""

    def __init__(self, page: Page) -> None:
        """Stand between the page and its server."""
        self._held: list[str | bytes] | None = None
        self._server: WebSocketRoute | None = None
        page.route_web_socket("**/socket.io/**", self._join)

    def _join(self, route: WebSocketRoute) -> None:
        self._server = route.connect_to_server()
        route.on_message(self._pass)

    def _pass(self, message: str | bytes) -> None:
        assert self._server is not None
        if self._held is not None:
            self._held.append(message)
        else:
            self._server.send(message)

    def hold(self) -> None:
        """Keep what the browser sends."""
        self._held = []

    def release(self) -> None:
        """Send what was kept, in its order."""
        assert self._server is not None and self._held is not None
        held, self._held = self._held, None
        for message in held:
            self._server.send(message)


@pytest.fixture(scope="module")
def tuner(ros_module: Ros) -> Tuner:
    """Give a tuning server."""
    return Tuner(ros_module)


@pytest.fixture(scope="module")
def page(ros_module: Ros) -> Iterator[tuple[Page, LateBrowser]]:
    """Give the operator's page on a panel of its own, with the tuning form in front."""
    port = free_port()
    panel: Process = ros_module.run(
        "operator_panel", "operator_panel", f"_port:={port}", env={VARIABLE: TOKEN}
    )
    wait_until(lambda: "to watch" in panel.output, 30.0, "the operator panel")
    with kept_chromium() as browser:
        opened = browser.new_page()
        late = LateBrowser(opened)
        opened.goto(f"http://127.0.0.1:{port}/?token={TOKEN}")
        opened.get_by_role("tab", name="Tuning").click()
        yield opened, late
    panel.stop()


def test_undone_gain_is_shown_though_the_browser_is_late(
    tuner: Tuner, page: tuple[Page, LateBrowser]
) -> None:
    """Show the old gain after Undo, where each change tells its ranges before its values.

    The browser may echo a value that the server sets; the echo reaches the server after the next
    value. Until now the server took it for typed text and sent nothing at the undoing.
    """
    opened, late = page
    field = opened.get_by_label("position d", exact=True)
    tuner.tell_range(100.0)
    tuner.tell_value(22.96)
    expect(field).to_have_value("22.96", timeout=20_000)
    field.fill("23.5")
    opened.get_by_role("button", name="Preview step").click()
    expect(opened.get_by_text("gain p is missing")).to_be_visible(timeout=20_000)
    late.hold()
    tuner.tell_range(200.0)
    expect(field).to_have_attribute("title", "alone: 0 to 200", timeout=20_000)
    tuner.tell_value(23.5)
    expect(field).to_have_value("23.5", timeout=20_000)
    tuner.tell_range(300.0)
    expect(field).to_have_attribute("title", "alone: 0 to 300", timeout=20_000)
    late.release()
    opened.get_by_role("button", name="Preview step").click()
    tuner.tell_value(22.96)
    expect(field).to_have_value("22.96", timeout=20_000)


def test_new_range_keeps_what_is_typed(tuner: Tuner, page: tuple[Page, LateBrowser]) -> None:
    """A range depends on the other gains; it says nothing about this one's value."""
    opened, _ = page
    field = opened.get_by_label("position d", exact=True)
    # A value of its own: the page may show the test's before already, and each value that comes
    # fills the field anew.
    tuner.tell_value(24.75)
    expect(field).to_have_value("24.75", timeout=20_000)
    field.fill("23.5")
    tuner.tell_range(400.0)
    expect(field).to_have_attribute("title", "alone: 0 to 400", timeout=20_000)
    expect(field).to_have_value("23.5")
    # Changed and changed back before the panel looked: what is typed is in force for nobody.
    tuner.tell_value(24.75)
    expect(field).to_have_value("24.75", timeout=20_000)
