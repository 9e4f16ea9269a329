"""The state table as a page for people.

``python -m twin_controller.core.lead.table_page > docs/state_table.md`` writes it.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator

from twin_controller.core.lead.modes import Mode, Trigger
from twin_controller.core.lead.table import RESUME_ROWS, RESUMING, Row, look_up

INTRODUCTION = """# The state table of the twin controller
Generated from `twin_controller.core.lead.table` by
`python -m twin_controller.core.lead.table_page`; a test keeps it up to date.

Every pair of a mode and a trigger has a row. Conditions are part of the trigger (`MOVE` or
`MOVE_UNALIGNED`), so a row decides nothing. "stays" means that the mode does not change; "refused"
is an answer to the operator, and nothing is done. When several triggers hold at once the most
urgent one counts: links, then alarms and stops, then zones and people, then who leads, then rest.
"""

TRIGGERS = """
## Triggers
| trigger | what has happened |
|---|---|
"""


def table_page() -> str:
    """Return the page in Markdown."""
    parts = [INTRODUCTION, TRIGGERS]
    parts += [f"| `{trigger.name}` | {trigger.value} |\n" for trigger in Trigger]
    for mode in Mode:
        parts += _section(mode)
    return "".join(parts)


def _section(mode: Mode) -> Iterator[str]:
    """Yield one mode: a line for each trigger that decides something, then those that do not."""
    yield f"\n## {mode.name}\n| trigger | next mode | actions | why |\n|---|---|---|---|\n"
    silent = []
    for trigger, paused, row in rows(mode):
        if row.silent:
            silent.append(f"`{trigger.name}`")
        else:
            after = f" after {paused.name}" if paused is not None else ""
            why = row.why or trigger.value
            yield f"| `{trigger.name}`{after} | {_next(row)} | {_actions(row)} | {why} |\n"
    if silent:
        yield f"\nNothing is decided on {', '.join(silent)}.\n"


def rows(mode: Mode) -> Iterator[tuple[Trigger, Mode | None, Row]]:
    """Yield every trigger in this mode with its row.

    In PAUSED those that go on have a row for each mode that can be paused.
    """
    for trigger in Trigger:
        if mode is Mode.PAUSED and trigger in RESUMING:
            for paused in RESUME_ROWS:
                yield trigger, paused, look_up(mode, trigger, paused)
        else:
            yield trigger, None, look_up(mode, trigger)


def _next(row: Row) -> str:
    if row.refused:
        return "refused"
    return "stays" if row.to is None else row.to.name


def _actions(row: Row) -> str:
    return ", ".join(command.value for command in row.commands) or "none"


if __name__ == "__main__":
    sys.stdout.write(table_page())
