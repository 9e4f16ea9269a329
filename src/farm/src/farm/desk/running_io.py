"""Start router, desk and page in this process, and keep them until a signal."""

from __future__ import annotations

import contextlib
import os
import signal
import threading
from datetime import datetime, timezone
from pathlib import Path

from scara_ros.page.page_token_io import PageError, page_token, ros_home, shown_address
from scara_ros.page.token_file_io import TokenError

from farm.bus_io import BusError, open_router
from farm.config import FarmConfig
from farm.desk.desk_io import Desk
from farm.desk.history_io import History, HistoryError
from farm.security.invitation_io import SecurityError, keys_folder

TOKEN_VARIABLE, TOKEN_FILE = "FARM_DESK_TOKEN", "farm_desk_token"
EVENTS = "events"
"""Folder of the history, in the desk's data."""


class DeskStartError(RuntimeError):
    """The desk cannot be started; the text says why and what to do."""


def run(
    config: FarmConfig,
    folder: Path,
    who: tuple[str, str],
    with_page: bool,
    reached: tuple[str, int] | None = None,
) -> None:
    """Keep the desk until SIGINT or SIGTERM.

    Args:
        config: farm.yaml.
        folder: The desk's data.
        who: Person and desk in whose name the page sends commands.
        with_page: Whether the page is served.
        reached: Host and port at which invited machines come in; None: only this machine.

    Raises:
        DeskStartError: A port is taken, or the folder or the token cannot be used.
    """
    settings = config.desk
    try:
        history = History(folder / EVENTS, settings.small_files, settings.small_file_mb)
        # First the history: who cannot keep events shall not take the router's port.
        with history, open_router(config.router, config.lease_ms) as session:
            print(f"farm: router at {config.router.endpoint}, history in {folder}", flush=True)
            with _door(config, reached), Desk(session, config, history) as desk:
                if with_page:
                    _serve(desk, config, who)
                else:
                    ended = threading.Event()
                    for number in (signal.SIGINT, signal.SIGTERM):
                        signal.signal(number, lambda *_: ended.set())
                    print("farm: the desk is ready, without a page", flush=True)
                    ended.wait()
    except (HistoryError, BusError, SecurityError, TokenError) as error:
        raise DeskStartError(str(error)) from error


def _door(
    config: FarmConfig, reached: tuple[str, int] | None
) -> contextlib.AbstractContextManager[object]:
    """Open the door for other machines, and say who may come in; None: there is none."""
    if reached is None:
        return contextlib.nullcontext()
    # Imported late: the library of certificates takes a tenth of a second.
    from farm.security.authority_io import SiteAuthority, authority_folder
    from farm.security.door_io import MemberDoor

    folder = authority_folder(keys_folder(os.environ))
    made = MemberDoor(config, folder, reached)
    names = ", ".join(made.names or ()) or "nobody: ./cell farm invite NAME"
    print(f"farm: machines come in at {reached[0]}:{reached[1]}; invited: {names}", flush=True)
    for each in SiteAuthority(folder, config.site, datetime.now(timezone.utc)).ending():
        until = datetime.fromtimestamp(each.until).strftime("%Y-%m-%d")
        print(f"farm: the certificate of {each.name} ends {until}: invite it again", flush=True)
    return made


def _serve(desk: Desk, config: FarmConfig, who: tuple[str, str]) -> None:
    """Serve the page until a signal."""
    # Imported late: NiceGUI takes a second, and only the page needs it.
    from farm.desk.page_io import Page, serve

    settings, file = config.desk, ros_home() / TOKEN_FILE
    token = page_token(TOKEN_VARIABLE, file)
    web = Path(__file__).resolve().parents[3] / "web"
    Page(desk, config.site, web, who, settings.expiry_ms * 1e-3)
    told = shown_address(settings.host, settings.port, token, file)
    try:
        serve(settings.host, settings.port, token, f"{config.site}: farm", told)
    except PageError as error:
        raise DeskStartError(str(error)) from error
