"""One open page on the server's side: its session, its buttons, its notices."""

from __future__ import annotations

import time
from collections.abc import Awaitable, Callable
from typing import Any

from nicegui import ui
from scara_config import ConfigError, Robot
from scara_config.frames import NO_FRAMES, find_frames
from scara_ros.page.page_library_io import plain

from operator_panel.config import PanelConfig, Surroundings
from operator_panel.control.authority import Role, command_refusal
from operator_panel.control.desk_io import PageDesk, Session
from operator_panel.control.frame_lessons import jog_axes
from operator_panel.door import Answer, CellDoor
from operator_panel.view.snapshot import Snapshot


class PageView:
    """What the parts of a page share.

    Attributes:
        robot: Its joints.
        config: operator_panel.yaml.
        around: What is shown of other rooms' files.
        door: The cell.
        desk: Who may command.
        session: This page.
        frames: User and tool frames as they were read last.
        frames_fault: Why their file cannot be read; the page works without them.
        after: Called with (snapshot, silent) when something about buttons changed.
    """

    def __init__(
        self,
        robot: Robot,
        config: PanelConfig,
        around: Surroundings,
        door: CellDoor,
        desk: PageDesk,
        session: Session,
    ) -> None:
        """Remember everything."""
        self.robot, self.config, self.around = robot, config, around
        self.door, self.desk, self.session = door, desk, session
        self.frames, self.frames_fault = NO_FRAMES, ""
        self.after: list[Callable[[Snapshot, bool], None]] = []
        self._guarded: list[tuple[Any, str, str]] = []
        self._frames_shown: list[Callable[[], None]] = []
        # How often any page had written the frames when this one read them last.
        self._taught = 0
        self._shown: tuple[object, ...] = ()

    def read_frames(self) -> None:
        """Read frames.yaml, and jog by it; a wrong one must not keep a page from opening."""
        before = self.frames, self.frames_fault
        try:
            self.frames, self.frames_fault = find_frames(self.around.folder), ""
        except ConfigError as error:
            self.frames_fault = str(error)
        else:
            self.desk.arm.set_frames(jog_axes(self.frames))
        if (self.frames, self.frames_fault) != before:
            for show in self._frames_shown:
                show()

    def on_frames(self, show: Callable[[], None]) -> None:
        """Call ``show`` now, and whenever the frames are others than before."""
        self._frames_shown.append(show)
        show()

    @property
    def is_operator(self) -> bool:
        """Whether the page may command at all."""
        return self.session.role is Role.OPERATOR

    @property
    def name(self) -> str:
        """The person at this page, as the twin controller names the holder of control."""
        return self.session.seat.name

    def guard(self, element: Any, command: str) -> Any:
        """Enable ``element`` only while ``command`` makes sense and this page may send it."""
        self._guarded.append((element, command, element.props.get("title", "")))
        element.set_enabled(False)
        return element

    def button(
        self, text: str, command: str, style: str = "", on_click: Callable[[], Any] | None = None
    ) -> ui.button:
        """Make a guarded button; without ``on_click`` it sends the command."""

        async def send() -> None:
            await self.send(command)

        made = push_button(text, on_click or send, style).mark(command.lower())
        self.guard(made, command)
        return made

    async def act(self, kind: str, title: str, act: Callable[[], Awaitable[Answer]]) -> Answer:
        """Take control if nobody holds it, and do something; its place shows what becomes of it."""
        number = self.desk.begin(self.session.page, kind, title)
        refused = await self.desk.take(self.session.page)
        answer = Answer(False, refused) if refused else await act()
        self.desk.ended(number, answer)
        return answer

    async def grip(self, text: str, close: bool, asked: float | None = None) -> Answer:
        """Switch the gripper, at a press of now or of ``asked`` [s]: a newer stop refuses it."""
        pressed = time.monotonic() if asked is None else asked
        return await self.act("GRIPPER", text, lambda: self.door.grip(close, asked=pressed))

    async def send(self, command: str, title: str = "", **fields: Any) -> Answer:
        """Send a command; its place on the page shows what becomes of it, under ``title``."""
        return await self.desk.command(self.session.page, command, title, **fields)

    def tell(self, answer: Answer, what: str) -> None:
        """Show an answer to an operator, at the place of the commands, which all pages share."""
        if self.is_operator:
            self.desk.note(self.session.page, what, answer)

    def refresh(self, snapshot: Snapshot, silent: bool) -> None:
        """Bring buttons and frames up to date; cheap while nothing has changed."""
        if self._taught != self.desk.taught:
            self._taught = self.desk.taught
            self.read_frames()
        refused = snapshot.refused()
        state = snapshot.state
        hands = state and (state.holder, state.not_in_control)
        shown = (refused, silent, hands, self.name)
        if shown != self._shown:
            self._shown = shown
            for element, command, title in self._guarded:
                barred = self.desk.refusal(self.session.page, command) or command_refusal(
                    command, refused, silent
                )
                element.set_enabled(not barred)
                # Shown under the pointer, and read by a screen reader as the description.
                element.props["title"] = barred or title
        for part in self.after:
            part(snapshot, silent)


def live(key: str, style: str = "", tag: str = "span") -> ui.element:
    """Make a place whose text comes with each frame."""
    return ui.element(tag).props(f'data-live="{key}"').classes(f"live {style}")


def push_button(
    text: str, on_click: Callable[[], Any] | None, style: str = "", props: str = ""
) -> ui.button:
    """Make a button that the server hears, for everybody; without ``on_click`` the browser does."""
    made = ui.button(text, on_click=on_click, color=None)
    return made.props(f"unelevated no-caps dense {props}").classes(f"button {style}")


def card(title: str, style: str = "") -> ui.element:
    """Make a card with a small heading; use it as a context."""
    made = ui.element("section").classes(f"card {style}")
    with made:
        if title:
            plain(title, "card-title", "h2")
    return made
