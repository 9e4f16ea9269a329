"""Command line of ``./cell bench --stops``: measure all rows and write docs/operating/stops.md."""

from __future__ import annotations

import sys
import time
from datetime import datetime, timezone
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from rich.console import Console

from harness.workspace import ROOT, enter_workspace

PAGE = ROOT / "docs" / "operating" / "stops.md"


def main() -> None:
    """Measure, show how far it is, write the page."""
    enter_workspace()
    from harness.stops.page import page
    from harness.stops.rows import Row, instants, measure
    from harness.virtual_cell.__main__ import commit
    from harness.virtual_cell.cell import CellError

    console, found = Console(highlight=False), dict[object, list[Row] | str]()
    begun = time.process_time()
    for instant in instants():
        try:
            found[instant] = measure(instant)
        except CellError as error:
            found[instant] = str(error)
        console.print(f"{instant}: {time.process_time() - begun:.0f} s of processor time")
    today = datetime.now(timezone.utc).strftime("%Y-%m-%d")
    PAGE.write_text(page(found, today, commit()), encoding="utf-8")
    console.print(f"written: {PAGE.relative_to(ROOT)}", soft_wrap=True)


if __name__ == "__main__":
    main()
