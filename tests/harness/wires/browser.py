"""Debian's Chromium, as it is built for machines without a screen."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from pathlib import Path

from playwright.sync_api import Browser, Playwright, sync_playwright

from harness.running.shared import BROWSERS

CHROMIUM = Path("/usr/bin/chromium-headless-shell")
FLAGS = ["--no-sandbox", "--disable-background-networking"]
NOTHING_DRAWN = ["--disable-gpu", "--disable-3d-apis"]
DRAWN_BY_THE_PROCESSOR = ["--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
# Where nobody measures the page: only the model is drawn as by a graphics card, not all around it,
# all of it in the browser's own process, and scripts get the quick compilers alone: a page lives
# for a minute at most.
UNMEASURED = ["--disable-gpu-compositing", "--in-process-gpu", "--js-flags=--no-turbofan"]
# A kernel that groups processes by session heeds their priority only within their group, so the
# group of the browser's session gets a low one, too. The tests that only compute come behind it.
# With a lower one a page was once loaded anew beside a process that kept a processor busy.
BEHIND_THE_CELL = f"""#!/bin/sh
[ ! -w /proc/self/autogroup ] || echo 5 > /proc/self/autogroup
exec nice -n 5 {CHROMIUM} "$@"
"""
DRIVER = "driver"
LOAD_MS = 120_000
"""How long a page may load: what it shows is judged, not how busy the machine is."""


@contextmanager
def chromium(folder: Path, draws: bool = False) -> Iterator[Browser]:
    """Start a browser that leaves the machine to the cell that it looks at; end it with the block.

    Args:
        folder: Where its start script is written.
        draws: Whether it draws models, which then takes much of the processor.
    """
    script = folder / "chromium"
    script.write_text(BEHIND_THE_CELL)
    script.chmod(0o755)
    # One process has one driver at a time.
    kept = DRIVER in BROWSERS
    driver = nullcontext(BROWSERS.get(DRIVER, sync_playwright)) if kept else sync_playwright()
    with driver as playwright, _launched(playwright, script, draws) as browser:
        yield browser


@contextmanager
def kept_chromium(draws: bool = False) -> Iterator[Browser]:
    """Give the browser that this process keeps for pages without a cell; end what the block opens.

    Args:
        draws: Whether it draws models, which then takes much of the processor.
    """
    name = f"chromium {draws}"

    def start() -> AbstractContextManager[Browser]:
        return _launched(BROWSERS.get(DRIVER, sync_playwright), CHROMIUM, draws, UNMEASURED)

    browser: Browser = BROWSERS.get(name, start)
    if not browser.is_connected():  # a test has broken it
        BROWSERS.close()
        browser = BROWSERS.get(name, start)
    before = browser.contexts
    try:
        yield browser
    finally:
        for context in browser.contexts:
            if context not in before:
                context.close()


@contextmanager
def _launched(
    playwright: Playwright, program: Path, draws: bool, besides: Sequence[str] = ()
) -> Iterator[Browser]:
    flags = [*FLAGS, *besides] + (DRAWN_BY_THE_PROCESSOR if draws else NOTHING_DRAWN)
    browser = playwright.chromium.launch(executable_path=program, args=flags)
    try:
        yield browser
    finally:
        browser.close()
