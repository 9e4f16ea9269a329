"""Rows of a cell that is not alone on its machine: page_open, two_cells."""

from __future__ import annotations

from bench.cells.page_open import look
from bench.cells.side_by_side import CELLS, TOGETHER_S, work_together
from bench.record import Beside, Goal, Record
from bench.room import Room

REST_PERCENT, MOVING_PERCENT = 25.0, 60.0
"""Of a core, for a browser that draws without a graphics card; our choice: half of what is left."""
ARTICLE_PERCENT = 5.0


def page_open(room: Room) -> Record:
    """Processor time of a browser with the operator's page, which draws on the processor."""
    seen = look(room)
    return Record(
        "page_open",
        seen.moving,
        None,
        "% of a core",
        (Goal("ours", MOVING_PERCENT),),
        measured="all processes of Chromium without a graphics card, 1280 x 720, operator page of "
        "a whole cell, robot leads",
        against="none",
        statistic="mean",
        beside=(
            Beside(
                "the same at rest",
                seen.rest,
                "% of a core",
                f"<= {REST_PERCENT:g}",
                seen.rest <= REST_PERCENT,
            ),
        ),
        note=seen.note,
    )


def two_cells(room: Room) -> Record:
    """Links that two cells lose that share the machine."""
    seen = work_together(room)
    ended = [text for cell in seen for text in cell.ended]
    errors = [error for cell in seen for error in cell.errors]
    worst = max(errors) if errors else None
    return Record(
        "two_cells",
        sum(cell.lost for cell in seen),
        None,
        "links lost",
        (Goal("ours", 0.0),),
        measured=f"{CELLS} x ./cell up, all nodes, no browser; both run the article's two "
        f"experiments again and again for {TOGETHER_S / 60.0:.0f} min",
        against="none",
        statistic="sum",
        beside=(
            Beside("runs with a report", sum(cell.runs for cell in seen), ""),
            Beside("runs that ended without one", len(ended), "", "<= 0", not ended),
            Beside(
                "largest path error of all",
                worst,
                "% of reach",
                f"<= {ARTICLE_PERCENT:g}",
                worst is not None and worst <= ARTICLE_PERCENT,
            ),
        ),
        note="; ".join(ended)[:300],
    )
