"""Moving the pair by hand: commands, speed cap, jog with a held button."""

from __future__ import annotations

from nicegui import ui
from scara_config import Joint

from operator_panel.io.page.charts import joint_title
from operator_panel.io.page.view import PageView, live, plain
from operator_panel.view import words


def build_commands(view: PageView) -> None:
    """Build the row of commands and the speed."""
    with ui.element("section").classes("card commands-card"):
        with ui.element("div").classes("commands"):
            for command in ("PAUSE", "RESUME", "RESET", "HOME", "ALIGN", "ACKNOWLEDGE"):
                view.button(command.capitalize(), command)
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


def build_jog(view: PageView) -> None:
    """Build the held buttons; the browser sends signs while one is held."""
    limit = view.around.jog_limit_percent
    with ui.element("div").classes("jog"):
        for joint in view.robot.twin_joints:
            with ui.element("div").classes("jog-row"):
                _jog_button(view, joint, -1)
                plain(joint_title(joint.name), "jog-name")
                _jog_button(view, joint, 1)
    with ui.element("div").classes("jog-speed"):
        plain("Speed", "field-title")
        slider = ui.slider(
            min=0.5, max=limit, step=0.5, value=min(view.config.jog.speed_percent, limit)
        )
        slider.classes("speed-slider").props("data-jog-speed").mark("jog-speed")
        shown = ui.label("").classes("num jog-speed-value")

        def show(percent: float) -> None:
            shown.set_text(f"{percent:g} % = {_speeds(view.robot.twin_joints, percent)}")
            ui.run_javascript(f"window.panelJogPercent = {percent:g}")

        slider.on_value_change(lambda event: show(event.value))
        show(slider.value)
        view.guard(slider, "JOG")
    with ui.element("div").classes("hint"):
        plain("Hold to move, let go to stop. The real robot follows the twin.")
        live("jog", "jog-state")


def _jog_button(view: PageView, joint: Joint, direction: int) -> None:
    sign = "+" if direction > 0 else words.MINUS
    button = (
        ui.button(sign, color=None).props("unelevated dense no-caps").classes("button jog-button")
    )
    button.props(
        f'data-jog="{joint.name}" data-direction="{direction}" '
        f'aria-label="Jog {joint_title(joint.name)} {sign}"'
    )
    view.guard(button, "JOG")


def _speeds(joints: list[Joint], percent: float) -> str:
    """Return the slowest and the fastest jog of joints that turn, and that of those that slide."""
    parts = []
    for unit in ("deg", "mm"):
        speeds = [
            joint.velocity / joint.scale * percent / 100.0 for joint in joints if joint.unit == unit
        ]
        if speeds:
            low, high = f"{min(speeds):.0f}", f"{max(speeds):.0f}"
            parts.append(f"{low if low == high else f'{low} to {high}'} {unit}/s")
    return ", ".join(parts)
