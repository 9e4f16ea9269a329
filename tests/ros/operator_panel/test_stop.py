"""STOP from the page gets through whatever else fails, or the page says so in time.

The twin controller is a bare service, so that it can stand still and live on without a master.
"""

from __future__ import annotations

import json
import re
import signal
import time
from collections.abc import Callable, Iterator

import pytest
from harness.page.theatre import TOKEN, Theatre
from harness.processes import Process, free_port, wait_until
from harness.ros import Ros
from harness.running.thorough import thorough
from harness.wires.browser import LOAD_MS, kept_chromium
from harness.wires.command_service import NAME, CommandService
from harness.wires.operator_page import Panel, heard
from playwright.sync_api import Locator, Page, WebSocketRoute, expect
from websockets.sync.client import ClientConnection

IN_TIME_S = 0.5


class Cell:
    """A master of its own, a twin controller and the panel, which have found each other."""

    def __init__(self, ros: Ros) -> None:
        """Start them."""
        port = free_port()
        uri = f"http://127.0.0.1:{port}"
        self.ros = ros
        self.master: Process = ros.stage.start(
            "rosmaster", "--core", "-p", str(port), env={"ROS_MASTER_URI": uri}
        )
        self.panel = Panel(ros, env={"ROS_MASTER_URI": uri})
        self.controller = CommandService()
        wait_until(lambda: self._registered(uri), 20.0, "the master")
        with self.panel.live() as live:
            wait_until(lambda: "no_stop" not in heard(live, "frame"), 20.0, "a tested line")

    def _registered(self, uri: str) -> bool:
        try:
            self.controller.register(uri, self.ros.name(NAME))
        except OSError:
            return False
        return True


@pytest.fixture
def cell(ros: Ros) -> Iterator[Cell]:
    """Give a cell of its own."""
    made = Cell(ros)
    yield made
    if made.master.poll() is None:
        made.master.signal(signal.SIGCONT)
    made.controller.close()


def stopped(live: ClientConnection, command: str = "STOP", press: int = 1) -> tuple[bool, float]:
    """Press; return whether it was confirmed, and after which time something was said."""
    begun = time.monotonic()
    live.send(json.dumps({"stop": command, "press": press}))
    answer = heard(live, "stopped")
    assert (answer["command"], answer["press"]) == (command, press)
    return answer["confirmed"], time.monotonic() - begun


@pytest.mark.parametrize("number", [*thorough(signal.SIGKILL), signal.SIGSTOP])
def test_first_stop_of_a_viewer_gets_through_without_a_master(
    cell: Cell, number: signal.Signals
) -> None:
    """Killed or standing still: nobody is asked where the controller is.

    By day the one that answers nothing: to ask it would take for ever, a killed one refuses.
    """
    cell.controller.heard.clear()  # of an attempt while the machine stood still
    with cell.panel.live() as viewer:
        cell.master.signal(number)
        # A page that shows the camera lets it be subscribed to, for which the master is asked.
        assert cell.panel.get("/camera.jpg").status == 503
        confirmed, after = stopped(viewer)
        assert confirmed and after < IN_TIME_S
        confirmed, after = stopped(viewer, "ESTOP")
        assert confirmed and after < IN_TIME_S
    assert cell.controller.heard == ["STOP", "ESTOP"]


def test_stop_that_is_not_answered_is_said_in_time_and_the_line_goes_on(cell: Cell) -> None:
    """What is let go is heard meanwhile; the late answer is told too."""
    with cell.panel.live(cell.panel.enter()) as live:
        cell.controller.answers.clear()
        for press in (1, 2):
            confirmed, after = stopped(live, press=press)
            assert not confirmed and after < IN_TIME_S
        live.send('{"hold": 1, "joint": "joint_1", "direction": 1, "percent": 3}')
        assert heard(live, "refused")["press"] == 1
        cell.controller.answers.set()
        assert heard(live, "stopped")["confirmed"]


@pytest.fixture
def viewer(cell: Cell) -> Iterator[Page]:
    """Give the page of somebody without a token, in a browser."""
    with kept_chromium() as browser:
        page = browser.new_page(viewport={"width": 1280, "height": 720})
        page.goto(f"http://127.0.0.1:{cell.panel.port}/", timeout=LOAD_MS)
        expect(page.locator("[data-panel].shown")).to_be_visible(timeout=30_000)
        yield page


def test_page_shows_at_a_fixed_place_what_became_of_a_stop(cell: Cell, viewer: Page) -> None:
    """Button, then Escape; where it is not confirmed, the whole width says what to do."""
    place = viewer.locator('[data-stop-answer="STOP"]')
    banner = viewer.locator(".banner-no-stop")
    before = place.bounding_box()
    viewer.get_by_role("button", name="STOP", exact=True).click()
    expect(place).to_have_text("confirmed")
    expect(banner).to_be_hidden()
    cell.controller.answers.clear()
    viewer.keyboard.press("Escape")
    expect(place).to_have_text("not confirmed")
    expect(banner).to_contain_text("STOP not confirmed: use the stop at the robot")
    width = viewer.evaluate("document.querySelector('.banner-no-stop').offsetWidth")
    assert width == viewer.evaluate("document.documentElement.clientWidth")
    cell.controller.answers.set()
    expect(place).to_have_text("confirmed")
    expect(banner).to_be_hidden()
    cell.controller.close()
    expect(banner).to_contain_text("STOP does not get through from here")
    expect(place).to_have_text("")
    assert place.bounding_box() == before
    assert cell.controller.heard == ["STOP", "STOP"]


def test_a_stop_is_pressed_by_whatever_presses_a_button(cell: Cell, viewer: Page) -> None:
    """Each Enter key, a screen reader's click without a pointer, Escape on another key; once each.

    Space is STOP's key on each button.
    """
    button, keys = viewer.locator('[data-stop="ESTOP"]'), viewer.keyboard
    heard = cell.controller.heard
    heard.clear()  # of an attempt while the machine stood still
    escape = {"key": "Escape", "code": "CapsLock", "bubbles": True}

    def held() -> None:
        for _ in range(3):
            keys.down("Enter")
        keys.up("Enter")

    def slipped_off() -> None:
        box = button.bounding_box()
        assert box is not None
        viewer.mouse.move(box["x"] + 5, box["y"] + 5)
        viewer.mouse.down()
        viewer.mouse.move(box["x"] + 5, box["y"] + 400)
        viewer.mouse.up()
        viewer.wait_for_timeout(400)  # longer than CLICK_MS of stop.js: it is no click's pointer

    simulated = {"detail": 1, "bubbles": True}
    presses: list[tuple[str, Callable[[], object]]] = [
        ("ESTOP", lambda: button.press("NumpadEnter")),
        ("ESTOP", lambda: button.dispatch_event("click")),
        ("ESTOP", button.click),
        ("ESTOP", held),
        ("ESTOP", slipped_off),
        ("ESTOP", lambda: button.dispatch_event("click", simulated)),
        ("STOP", lambda: button.press("Space")),
        ("STOP", lambda: button.dispatch_event("keydown", escape)),
    ]
    for count, (_, press) in enumerate(presses, start=1):
        press()

        def came(count: int = count) -> bool:
            return len(heard) >= count

        wait_until(came, 10.0, f"press {count}")
        assert heard == [command for command, _ in presses[:count]]


def test_page_whose_server_stands_still_says_so_itself(cell: Cell, viewer: Page) -> None:
    """The browser's own clock runs: nothing is awaited in vain, and nothing old is green."""
    place = viewer.locator('[data-stop-answer="STOP"]')
    viewer.keyboard.press("Space")
    expect(place).to_have_text("confirmed")
    cell.panel.process.signal(signal.SIGSTOP)
    try:
        expect(viewer.locator(".banner-lost")).to_be_visible()
        since = re.compile(r"since \d\d:\d\d:\d\d")
        expect(viewer.locator("body.is-lost .lost-text")).to_contain_text(since)
        expect(viewer.locator(".grid")).to_have_css("filter", "grayscale(1)")
        expect(place).to_have_text("")
        viewer.keyboard.press("Space")
        expect(place).to_have_text("not confirmed")
        expect(viewer.locator(".banner:visible").first).to_contain_text("use the stop at the robot")
    finally:
        cell.panel.process.signal(signal.SIGCONT)
    expect(viewer.locator("body:not(.is-lost)")).to_be_visible()


def test_confirmed_goes_with_the_mode_and_with_each_line_that_is_lost(theatre: Theatre) -> None:
    """Of the page, of the controller, of STOP itself; a line that comes back brings nothing."""
    page, place = theatre.page, theatre.page.locator('[data-stop-answer="STOP"]')

    def confirmed() -> None:
        theatre.play("following")
        page.keyboard.press("Escape")
        expect(place).to_have_text("confirmed")
        theatre.play("stopped")
        expect(place).to_have_text("confirmed")

    for scene in ("ready", "no_stop"):
        confirmed()
        theatre.play(scene)
        expect(place).to_have_text("")
    confirmed()
    page.request.get(f"{theatre.address}/scene/no_master")
    expect(page.locator(".banner-silent")).to_be_visible()
    expect(place).to_have_text("")
    confirmed()
    page.evaluate("panel.live.socket.close()")
    expect(page.locator(".banner-lost")).to_be_visible()
    expect(page.locator(".banner-lost")).to_be_hidden()
    expect(page.locator('[data-live="mode"]')).to_have_text("Stopped")
    assert place.inner_text() == ""


def to_be_aligned(theatre: Theatre) -> tuple[Locator, Locator]:
    """Show a stopped pair; return the button Align, and where it is told of once it is pressed."""
    theatre.play("stopped")
    align = theatre.page.get_by_role("button", name="Align", exact=True).locator("visible=true")
    return align, theatre.page.locator("[data-command]").filter(has_text="Align")


def test_nothing_that_was_pressed_while_the_connection_was_lost_is_done_later(
    theatre: Theatre,
) -> None:
    """By key, or by a finger in a dialog: it would come behind a STOP that was not sent."""
    page, (align, told) = theatre.page, to_be_aligned(theatre)
    align.focus()
    page.evaluate("panel.live.socket.close(); socket.disconnect(); socket.emit('event', {})")
    expect(page.locator(".banner-lost")).to_be_visible()
    page.keyboard.press("Enter")
    align.dispatch_event("click")
    waiting = page.evaluate("socket.sendBuffer.filter((each) => each.data[0] === 'event').length")
    page.evaluate("socket.connect()")
    expect(page.locator(".banner-lost")).to_be_hidden()
    assert (waiting, told.count()) == (0, 0)
    align.click()
    expect(told).to_have_count(1)


# The connection breaks, and right before the page shows it, a length is chosen and STOP pressed.
BREAK = """() => {
    window.isOld = true;
    socket.io.engine.close();
    document.querySelector('[data-step="10"]').click();
    panel.live.socket.close();
    window.dispatchEvent(new KeyboardEvent("keydown", { key: "Escape", code: "Escape" }));
}"""


def test_what_is_lit_after_a_loss_is_what_counts(theatre: Theatre) -> None:
    """The page begins anew: a step of 10 mm is no step of 0.1 mm. A STOP that failed stays said."""
    page, banner = theatre.page, theatre.page.locator(".banner-no-stop")
    theatre.play("ready")
    page.evaluate(BREAK)
    expect(banner).to_contain_text("STOP not sent")
    page.wait_for_function("() => !window.isOld && window.panel?.live.open")
    expect(banner).to_contain_text("STOP not sent")
    theatre.open("Jog")
    theatre.open("Step tool")
    shown = page.locator(".jog-way.shown [data-step][aria-selected=true]").inner_text()
    page.get_by_role("button", name="Step X +", exact=True).click()
    expect(page.locator("[data-command]").first).to_contain_text(re.compile(rf"X \+{shown}\b"))
    page.keyboard.press("Escape")
    expect(banner).to_be_hidden()


# Only the line of the server's buttons breaks; Align is pressed right before it comes back.
BREAK_ONE = """(button) => {
    window.isOld = true;
    socket.io.on("reconnect_attempt", () => button.click());
    socket.io.engine.close();
}"""


def test_nothing_that_was_pressed_while_only_the_buttons_line_was_lost_is_done_later(
    theatre: Theatre,
) -> None:
    """The page's other line lives on, so nothing is grey; what waits is forgotten."""
    page, (align, told) = theatre.page, to_be_aligned(theatre)
    align.evaluate(BREAK_ONE)
    page.wait_for_function("() => !window.isOld && window.panel?.live.open")
    expect(page.locator('[data-live="mode"]')).not_to_be_empty()
    assert told.count() == 0
    align.click()
    expect(told).to_have_count(1)


def test_line_that_broke_without_a_word_is_opened_again(theatre: Theatre) -> None:
    """As when a phone roams: its socket stays open, and neither side ever hears of an end."""
    theatre.play("ready")
    browser = theatre.page.context.browser
    assert browser is not None
    page = browser.new_page()
    lines: list[WebSocketRoute] = []
    broken: list[WebSocketRoute] = []

    def join(line: WebSocketRoute) -> None:
        lines.append(line)
        server = line.connect_to_server()
        line.on_message(lambda said: None if line in broken else server.send(said))
        server.on_message(lambda said: None if line in broken else line.send(said))
        line.on_close(lambda *_: None)

    page.route_web_socket("**/live?*", join)
    page.goto(f"{theatre.address}/?token={TOKEN}", timeout=LOAD_MS)
    expect(page.locator('[data-live="mode"]')).to_have_text("Ready")
    broken.extend(lines)
    expect(page.locator("body.is-lost")).to_be_visible()
    expect(page.locator("body:not(.is-lost)")).to_be_visible()
    assert len(lines) == 2
    page.keyboard.press("Escape")
    expect(page.locator('[data-stop-answer="STOP"]')).to_have_text("confirmed")
    page.close()


# One press whose answer comes behind the second mode; what stands below its button at the end.
PLAY = """async ([command, modes]) => {
    document.body.innerHTML = `<b class="no-stop-text"></b><b data-stop-answer="${command}"></b>`;
    const { Stop } = await import("/panel/stop.js");
    const stop = new Stop({ send: () => true });
    const answered = () => stop.answered(
        { command, press: 1, confirmed: true, success: true, text: "both are stopped" });
    stop.look({ mode: modes[0] });
    stop.send(command);
    for (const [index, mode] of modes.slice(1).entries()) {
        if (index === 1) answered();
        stop.look(mode === "silent" ? { mode: modes[0], silent: "silent" } : { mode });
    }
    return document.querySelector(`[data-stop-answer="${command}"]`).textContent;
}"""


@pytest.fixture(scope="module")
def empty(theatre: Theatre) -> Iterator[Page]:
    """Give a page of the same server that has only the places of one stop."""
    browser = theatre.page.context.browser
    assert browser is not None
    page = browser.new_page()
    page.goto(f"{theatre.address}/empty")
    yield page
    page.close()


@pytest.mark.parametrize(
    ("command", "modes", "in_force"),
    [
        ("STOP", ["TWIN_LEADS", "TWIN_LEADS", "STOPPED"], True),
        ("STOP", ["TWIN_LEADS", "TWIN_LEADS", "IDLE", "STOPPED"], True),
        ("STOP", ["TWIN_LEADS", "STOPPED", "STOPPED", "ESTOP"], True),
        ("STOP", ["TWIN_LEADS", "STOPPED", "STOPPED", "ALIGNING"], False),
        ("STOP", ["TWIN_LEADS", "STOPPED", "STOPPED", "OFFLINE"], False),
        ("STOP", ["ESTOP", "ESTOP", "ESTOP", "STOPPED"], False),
        ("STOP", ["FAULT", "FAULT", "FAULT", "STOPPED"], False),
        ("STOP", ["TWIN_LEADS", "STOPPED", "STOPPED", "silent"], False),
        ("ESTOP", ["TWIN_LEADS", "TWIN_LEADS", "ESTOP"], True),
        ("ESTOP", ["FAULT", "FAULT", "ESTOP", "ESTOP"], True),
        ("ESTOP", ["STOPPED", "STOPPED", "ESTOP", "STOPPED"], False),
        ("ESTOP", ["TWIN_LEADS", "ESTOP", "ESTOP", "OFFLINE"], False),
    ],
)
def test_a_stop_is_called_confirmed_while_it_is_in_force(
    empty: Page, command: str, modes: list[str], in_force: bool
) -> None:
    """Until a reset, an alignment or a loss; a mode from before the stop may come behind it."""
    told = empty.evaluate(PLAY, [command, modes])
    assert told == ("confirmed" if in_force else "")


# What stands over the page: a STOP is not sent, its line breaks later, then the pair is stopped.
FAILED = """async () => {
    document.body.innerHTML = '<b class="no-stop-text"></b><b data-stop-answer="STOP"></b>';
    const { Stop } = await import("/panel/stop.js");
    const stop = new Stop({ send: () => false });
    const told = [];
    const look = (frame) => {
        stop.look(frame);
        const text = document.querySelector(".no-stop-text").textContent;
        told.push(document.body.matches(".no-stop") && text);
    };
    stop.send("STOP");
    look({ mode: "TWIN_LEADS" });
    look({ mode: "STOPPED" }); // it may be older than the press
    await new Promise((resolve) => setTimeout(resolve, 600));
    look({ mode: "TWIN_LEADS", no_stop: "it does not get through now" });
    look({ mode: "TWIN_LEADS" });
    look({ mode: "STOPPED", silent: "silent" });
    look({ mode: "STOPPED" });
    return told;
}"""


def test_what_is_so_now_stands_before_a_stop_that_failed_and_a_stopped_pair_ends_both(
    empty: Page,
) -> None:
    """A red line that stays for ever is read by nobody."""
    failed, (first, older, now, after, silent, stopped) = "STOP not sent", empty.evaluate(FAILED)
    assert all(text.startswith(failed) for text in (first, older, after, silent))
    assert now == "it does not get through now"
    assert stopped is False and empty.locator("[data-stop-answer]").inner_text() == ""
