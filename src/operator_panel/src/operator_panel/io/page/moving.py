"""What to press next, the commands to the pair, and the speed cap."""

from __future__ import annotations

from nicegui import ui

from operator_panel.io.page.view import PageView, live, plain


def build_commands(view: PageView) -> None:
    """Build the commands, of which the next one is set off, and the speed."""
    with ui.element("section").classes("card commands-card").props('data-tone="next"'):
        live("next", "next-step", "p")
        with ui.element("div").classes("commands"):
            for command in ("PAUSE", "RESUME", "RESET", "HOME", "ALIGN", "ACKNOWLEDGE"):
                view.button(command.capitalize(), command, f"next-{command}")
        with ui.element("div").classes("speed-fact"):
            plain("Speed", "fact-title")
            live("speed.applied", "num").props('data-tone="speed.applied"')
            live("speed.reason", "speed-reason")
        with ui.element("div").classes("speed"):
            plain("Speed cap", "field-title")
            slider = (
                ui.slider(min=1, max=100, step=1, value=100).classes("speed-slider").mark("speed")
            )
            shown = ui.label("100 %").classes("num speed-value")
            slider.on_value_change(lambda event: shown.set_text(f"{event.value:.0f} %"))
            view.guard(slider, "SPEED")

            async def send() -> None:
                await view.send("SPEED", speed_percent=float(slider.value))

            view.button("Set", "SPEED", "", send)
