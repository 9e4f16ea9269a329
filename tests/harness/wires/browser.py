"""Debian's Chromium without a screen, which leaves the machine to the cell that it looks at."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from playwright.sync_api import Browser, sync_playwright

CHROMIUM = Path("/usr/bin/chromium")
FLAGS = ["--no-sandbox", "--disable-background-networking"]
NOTHING_DRAWN = ["--disable-gpu", "--disable-3d-apis"]
DRAWN_BY_THE_PROCESSOR = ["--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
# A kernel that groups processes by session heeds their priority only within their group, so the
# group of the browser's session gets a low one, too. The tests that only compute come behind it.
BEHIND_THE_CELL = f"""#!/bin/sh
[ ! -w /proc/self/autogroup ] || echo 10 > /proc/self/autogroup
exec nice -n 10 {CHROMIUM} "$@"
"""


@contextmanager
def chromium(folder: Path, draws: bool = False) -> Iterator[Browser]:
    """Start a browser of low priority, and end it with the block.

    Args:
        folder: Where its start script is written.
        draws: Whether it draws models, which then takes much of the processor.
    """
    script = folder / "chromium"
    script.write_text(BEHIND_THE_CELL)
    script.chmod(0o755)
    flags = FLAGS + (DRAWN_BY_THE_PROCESSOR if draws else NOTHING_DRAWN)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=script, args=flags)
        try:
            yield browser
        finally:
            browser.close()
