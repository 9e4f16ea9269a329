"""The teach pendant as a page: what it shows and what its keys do.

With it come the libraries that serve pages: 50 MB, which nobody needs before somebody looks.
"""

from __future__ import annotations

import socket
from collections.abc import Callable
from functools import partial

from scara_ros.page.page_door import PageDoor
from scara_ros.page.page_guard_io import PageGuard
from scara_ros.page.page_library_io import app, run, serve_pages, ui

from fanuc_emulator.pendant.pendant_link_io import PendantLink
from fanuc_emulator.pendant.pendant_station_io import PendantStation, expire_heartbeat
from fanuc_emulator.tp.executor import Program
from fanuc_emulator.uop import MODE_KEYS

REFRESH_S = 0.2
LAMPS = ("sysrdy", "cmdenbl", "progrun", "paused", "held", "fault", "atperch", "busy")
STEP_PERCENT = 5
# What a person at the robot can do wrong, as a switch: input, wording, what it causes.
SWITCHES = (
    ("panel_imstp", "Emergency stop button", "servo power off"),
    ("sfspd", "Safety fence open", "pauses, safety speed"),
    ("enbl", "Enable switch off", "no motion"),
)
STYLE = """
body { background: #2a2c2a; color: #e9e6d8;
  font: 14px/1.4 "DejaVu Sans Mono", ui-monospace, Menlo, Consolas, monospace; }
.nicegui-content { padding: 18px; align-items: center; }
.pendant { display: grid; grid-template-columns: minmax(0, 1.25fr) minmax(0, 1fr);
  gap: 18px; width: min(980px, 100%);
  background: #d8b21c; border-radius: 18px; padding: 20px;
  box-shadow: inset 0 0 0 3px #8f7510; color: #1d1b10; }
.lcd { background: #10231a; color: #b9f2c9; border-radius: 6px; padding: 14px 16px;
  min-height: 330px; }
.lcd b { color: #eafff0; } .lcd table { width: 100%; border-collapse: collapse; margin: 8px 0; }
.lcd td { text-align: right; padding: 1px 4px; white-space: nowrap; }
.lcd td:first-child { text-align: left; }
.lcd-line { white-space: pre-wrap; } .lcd .alarm { color: #ffb0a0; min-height: 2.8em; }
.lamps { display: flex; flex-wrap: wrap; gap: 6px; margin-top: 8px; }
.lamp { padding: 1px 7px; border-radius: 3px; background: #1b3a2b; color: #5d8a70;
  font-size: 12px; }
.lamp.lit { background: #7fe3a1; color: #0b2013; }
.lamp.lit.fault, .lamp.lit.held { background: #ff8d73; }
.keys { display: flex; flex-direction: column; gap: 12px; }
.key-row { display: grid; grid-template-columns: repeat(4, 1fr); gap: 8px; }
.key-title { font-size: 12px; text-transform: uppercase; letter-spacing: .06em; }
.key.q-btn { background: #33352f; color: #f3efd9; border-radius: 5px; min-height: 38px;
  font: inherit; font-weight: 700; }
.key.red.q-btn { background: #b3261e; }
.key.on.q-btn { background: #f3efd9; color: #7a1510; box-shadow: inset 0 0 0 3px #b3261e; }
.switch-row { display: grid; grid-template-columns: 1fr 1.1fr; gap: 8px; align-items: center;
  font-size: 12px; }
.title { grid-column: 1 / 3; display: flex; justify-content: space-between; font-weight: 700; }
@media (max-width: 760px) { .pendant { grid-template-columns: minmax(0, 1fr); }
  .title { grid-column: 1; } }
"""
# What is pressed while the page's line is lost would be done once it is back, behind a STOP.
WHILE_LOST = """
document.addEventListener("click", (event) => {
  if (window.socket?.connected) return;
  event.preventDefault();
  event.stopImmediatePropagation();
}, true);
// A key that was pressed before the loss was seen still waits here.
const forget = () => {
  const waiting = window.socket.sendBuffer;
  window.socket.sendBuffer = waiting.filter((packet) => packet.data[0] !== "event");
};
const watch = () => {
  if (!window.socket) return setTimeout(watch, 20); // the library makes it behind this script
  window.socket.io.on("reconnect_attempt", forget);
  window.socket.io.on("open", forget); // what waits is sent right after it
};
watch();
"""


class PendantPage:
    """Builds the page for each browser that opens it."""

    def __init__(
        self, station: PendantStation, programs: dict[int, Program], title: str, turns: bool
    ) -> None:
        """Remember the robot and its programs, and whether its mode switch can be turned here."""
        self._station, self._programs, self._title = station, programs, title
        self._turns = turns

    def build(self) -> None:
        """Build the page."""
        ui.add_css(STYLE)
        ui.add_body_html(f'<script type="module">{WHILE_LOST}</script>')
        with ui.element("div").classes("pendant"):
            with ui.element("div").classes("title"):
                ui.label(f"TEACH PENDANT  {self._title.upper()}")
                ui.label("the robot's own side")
            with ui.element("div").classes("lcd"):
                self._display()
            with ui.element("div").classes("keys"):
                self._keys()

    def _display(self) -> None:
        program, override = ui.label().classes("lcd-line"), ui.label().classes("lcd-line")
        # Only numbers, and names and units of robot.yaml, come into it.
        table = ui.html("", sanitize=False)
        alarm = ui.label().classes("lcd-line alarm")
        with ui.element("div").classes("lamps"):
            lamps = {name: ui.label(name.upper()).classes(f"lamp {name}") for name in LAMPS}

        def show() -> None:
            reading = self._station.reading
            program.set_text(reading.trouble or reading.program)
            shown = f"OVERRIDE {reading.override} %   {reading.mode}".rstrip()
            override.set_text("" if reading.trouble else shown)
            rows = (
                f"<tr><td>{name}</td><td><b>{q:.2f}</b> {unit}</td><td>{speed}</td></tr>"
                for name, q, v, unit in reading.rows
                for speed in ("-" if v is None else f"{v:.1f} {unit}/s",)
            )
            table.set_content(f"<table>{''.join(rows)}</table>")
            alarm.set_text(reading.alarm)
            for name, lamp in lamps.items():
                lamp.classes(replace=f"lamp {name}" + (" lit" if reading.lamps.get(name) else ""))

        ui.timer(REFRESH_S, show)

    def _keys(self) -> None:
        ui.label("Program").classes("key-title")
        with ui.element("div").classes("key-row"):
            for number, program in sorted(self._programs.items()):
                self._key(program.name, partial(_pulse, f"panel_run{number}")).style(
                    "grid-column: span 2"
                )
        with ui.element("div").classes("key-row"):
            self._key("HOLD", lambda link: link.set_signal("panel_hold", False))
            self._key("RESUME", _resume)
            self._key("ABORT", partial(_pulse, "panel_abort"))
            self._key("RESET", _reset)
        ui.label("Override").classes("key-title")
        with ui.element("div").classes("key-row"):
            for text, change in (("\N{MINUS SIGN}", -STEP_PERCENT), ("+", STEP_PERCENT)):
                self._key(text, partial(_change_override, change))
            for percent in (10, 100):
                self._key(f"{percent} %", partial(_override, percent))
        if self._turns:
            ui.label("Mode switch: the robot halts, then RESET").classes("key-title")
            with ui.element("div").classes("key-row"):
                for key in MODE_KEYS:
                    self._key(key.removeprefix("panel_").upper(), partial(_pulse, key))
        ui.label("Troubles to inject").classes("key-title")
        for name, text, effect in SWITCHES:
            self._switch(name, text, effect)
        with ui.element("div").classes("switch-row"):
            self._key("Heartbeat stands still", expire_heartbeat)
            ui.label("the robot stops itself, unless a controller beats on")

    def _key(self, text: str, act: Callable[[PendantLink], None]) -> ui.button:
        async def press() -> None:
            # Modbus calls block: on the event loop they would stop every page that is open.
            trouble = await run.io_bound(self._station.press, act)
            if trouble:
                ui.notify(trouble, type="negative")

        return (
            ui.button(text, on_click=press, color=None).props("unelevated no-caps").classes("key")
        )

    def _switch(self, name: str, text: str, effect: str) -> None:
        """A key that turns an input off and on again; normally it is on."""
        with ui.element("div").classes("switch-row"):
            key = self._key(
                text, lambda link: link.set_signal(name, not link.signal(name))
            ).classes("red" * (name == "panel_imstp"))
            ui.label(effect)
        ui.timer(
            REFRESH_S,
            lambda: (
                key.classes(add="on")
                if not self._station.reading.switches.get(name, True)
                else key.classes(remove="on")
            ),
        )


def _change_override(change: int, link: PendantLink) -> None:
    # From the robot: before the first reading the display shows none, which would be 0.
    _override(int(link.read("override_now")[0]) + change, link)


def _override(percent: int, link: PendantLink) -> None:
    link.write("override", [min(max(percent, 1), 100)])


def _pulse(name: str, link: PendantLink) -> None:
    link.pulse(name)


def _resume(link: PendantLink) -> None:
    link.set_signal("panel_hold", True)
    link.pulse("panel_start")


def _reset(link: PendantLink) -> None:
    """Release hold, clear alarms, switch the drives on; switches that are off stay off."""
    link.set_signal("panel_hold", True)
    link.pulse("panel_reset")


def serve_page(listener: socket.socket, page: PendantPage, door: PageDoor, title: str) -> None:
    """Serve the page to all who connect to a listening socket, until SIGINT or SIGTERM."""
    ui.page("/")(page.build)
    app.add_middleware(PageGuard, door=door)
    host, port = listener.getsockname()[:2]
    serve_pages(host, port, title, fd=listener.fileno(), favicon="\N{JOYSTICK}")
