"""Exercise 12: a morning in a cell's journal, and what a shift leader asks about it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

import msgspec
import numpy as np
from cell_recorder.journal.entries import (
    DONE,
    STOPPED,
    WARNING,
    Alarm,
    AnyEntry,
    Audit,
    Cycle,
    Decision,
    Start,
    encode,
)
from cell_recorder.journal.story import is_stop
from scara_config import Robot
from scara_course.marking import Table

from scara_msgs.msg import TwinControllerState as Mode

BEGUN = 1_794_812_400.0
"""Unix time of the first entry [s]: 2026-11-16, 07:00 UTC."""
FILE = "journal/cell/2026-11-16.jsonl"
PEOPLE = ("maria", "jonas", "li")
# By kind: mode, trigger, how the cell goes on.
STOPS = {
    "stop": (Mode.STOPPED, "STOP", "ALIGN"),
    "pause": (Mode.PAUSED, "PAUSE", "RESUME"),
    "link": (Mode.OFFLINE, "LINK_LOST", "LINKS_READY"),
}
JOURNAL, MORNING = "journal", "morning"


def draw(generator: np.random.Generator) -> Table:
    """Draw the cycles of a morning; row by row what happened."""
    # Each kind of stop comes at least once, so that to count one of them alone is always wrong.
    kinds = [*STOPS, *generator.choice(list(STOPS), 2), *["done"] * 5]
    given: Table = {MORNING: {"alarm_s": int(generator.integers(5, 55))}}
    for number, kind in enumerate(generator.permutation(kinds), 1):
        given[f"cycle_{number}"] = {
            "kind": str(kind),
            "lasts_s": int(generator.integers(12, 50)),
            "stands_s": int(generator.integers(61, 900)),
            "placed": int(generator.integers(1, 10)),
            "dropped": int(generator.integers(0, 3)),
            "worst_mm": int(generator.integers(60, 480)) / 100,
            "who": str(generator.choice(PEOPLE)),
            "refused": int(generator.integers(0, 3)),
        }
    return given


def entries(given: Table) -> list[AnyEntry]:
    """Return the journal."""
    found: list[AnyEntry] = []
    now = BEGUN

    def add(entry: AnyEntry, later: float = 0.0) -> None:
        nonlocal now
        now += later
        found.append(msgspec.structs.replace(entry, number=len(found) + 1, cell="cell", time=now))

    def decide(before: str, event: str, after: str, who: str = "", later: float = 0.0) -> None:
        words = event.lower().replace("_", " ")
        lead = "real" if after == Mode.REAL_LEADS else ""
        add(
            Decision(
                seq=len(found),
                mode_before=before,
                event=event,
                mode_after=after,
                leader=lead,
                actions=[],
                why=words,
                who=who,
            ),
            later,
        )

    add(Start(robot="fanuc_sr6ia", plant="ideal", pid=4711))
    alarm_s = float(given[MORNING]["alarm_s"])
    for number, row in enumerate(rows(given)):
        kind, who, lasts = str(row["kind"]), str(row["who"]), float(row["lasts_s"])
        for _ in range(int(row["refused"])):
            add(Audit(who=who, what="MOVE", success=False, outcome="nobody may move it"), 3.0)
        add(Audit(who=who, what="SPEED 50 %", success=True, outcome="accepted"), 4.0)
        decide(Mode.IDLE, "REAL_TOOK_OVER", Mode.REAL_LEADS, later=20.0)
        begun = now
        if number == 2:
            alarm = Alarm(source="real", level=WARNING, active=True, text="late answers")
            add(alarm, 1.0)
            add(
                Alarm(
                    source="real", level=WARNING, active=False, text="late answers", seconds=alarm_s
                ),
                alarm_s,
            )
        if kind in STOPS:
            mode, event, onward = STOPS[kind]
            asked = "" if kind == "link" else who
            decide(Mode.REAL_LEADS, event, mode, asked, lasts)
        else:
            decide(Mode.REAL_LEADS, "AT_REST", Mode.IDLE, later=lasts)
        add(
            Cycle(
                start=begun,
                end=now,
                program="PALLETISE",
                leader="real",
                who="",
                parts_placed=int(row["placed"]),
                parts_dropped=int(row["dropped"]),
                worst_error_mm=float(row["worst_mm"]),
                paused_s=0.0,
                outcome=DONE if kind not in STOPS else STOPPED,
                why="" if kind not in STOPS else event.lower().replace("_", " "),
            )
        )
        if kind in STOPS:
            decide(mode, onward, Mode.IDLE, asked, float(row["stands_s"]))
    return found


def rows(given: Table) -> list[dict[str, float | str]]:
    """Return the cycles."""
    return [row for name, row in given.items() if name != MORNING]


def material(given: Table, robot: Robot) -> dict[str, str]:
    """Return the journal's file."""
    del robot
    return {FILE: b"".join(map(encode, entries(given))).decode()}


def solve(given: Table, robot: Robot) -> Table:
    """Read the answers out of the journal."""
    del robot
    return {JOURNAL: told(entries(given))}


def told(held: Sequence[AnyEntry]) -> dict[str, float | str]:
    """Return what is asked for."""
    stops = [entry for entry in held if isinstance(entry, Decision) and is_stop(entry)]
    cycles = [entry for entry in held if isinstance(entry, Cycle)]
    # Nobody asks for a lost link.
    first = next(entry for entry in stops if entry.who)
    return {
        "stops": len(stops),
        "first_stopped_by": first.who,
        "longest_stop_s": max(went_on(held, stop) - stop.time for stop in stops),
        "refused": sum(isinstance(entry, Audit) and not entry.success for entry in held),
        "alarm_s": sum(entry.seconds for entry in held if isinstance(entry, Alarm)),
        "parts_placed": sum(cycle.parts_placed for cycle in cycles),
        "worst_mm": max(cycle.worst_error_mm or 0.0 for cycle in cycles),
    }


def went_on(held: Iterable[AnyEntry], stop: Decision) -> float:
    """Return when a cell went on after a stop [s]."""
    return next(
        entry.time
        for entry in held
        if isinstance(entry, Decision) and entry.number > stop.number and not is_stop(entry)
    )


def mistakes(given: Table, robot: Robot) -> dict[str, Table]:
    """Return what usual mistakes give."""
    held = entries(given)
    right = solve(given, robot)[JOURNAL]
    cycles = [entry for entry in held if isinstance(entry, Cycle)]
    stops = [entry for entry in held if isinstance(entry, Decision) and is_stop(entry)]
    stands = [went_on(held, stop) - stop.time for stop in stops]

    def count(wanted: Callable[[AnyEntry], bool]) -> int:
        return sum(map(wanted, held))

    def other(**changed: float | str) -> Table:
        return {JOURNAL: {**right, **changed}}

    return {
        "a pause and a lost link stop the cell too": other(
            stops=count(lambda e: isinstance(e, Decision) and e.event == "STOP")
        ),
        "not every decision is a stop": other(stops=count(lambda e: isinstance(e, Decision))),
        "the first stop that somebody asked for, not the last": other(
            first_stopped_by=[stop for stop in stops if stop.who][-1].who
        ),
        "the longest of all stops, not their sum": other(longest_stop_s=sum(stands)),
        "the longest of all stops, not the first": other(longest_stop_s=stands[0]),
        "asked for are seconds, not minutes": other(
            longest_stop_s=float(right["longest_stop_s"]) / 60
        ),
        "what was obeyed is not refused": other(refused=count(lambda e: isinstance(e, Audit))),
        "dropped parts were not placed": other(
            parts_placed=sum(cycle.parts_placed + cycle.parts_dropped for cycle in cycles)
        ),
        "all cycles place parts, those that were stopped too": other(
            parts_placed=sum(cycle.parts_placed for cycle in cycles if cycle.outcome == DONE)
        ),
        "the largest of all cycles, not the last one's": other(
            worst_mm=cycles[-1].worst_error_mm or 0.0
        ),
    }
