"""A roll-out, step by step: one cell first, then the rest, and an end where one is not well."""

from __future__ import annotations

import pytest
from farm.desk.rollout import Do, next_step
from farm.desk.roster import LOST, SILENT, Alike, Row, alike
from farm.wire import Configuration, Level
from msgspec.structs import replace

WANTED, WAIT_S = "slow (1a2b)", 60.0
CELLS = ("m/a", "m/b", "m/c")
OWN = Configuration()
TOLD = Configuration(1, "", WANTED, proven=False)
TRIED = Configuration(1, WANTED, WANTED, proven=False)
RUNS = Configuration(1, WANTED, WANTED)


def row(name: str, shown: Configuration | None, **more: object) -> Row:
    """Return a cell that is well."""
    good = Row(name, Level.GOOD, "IDLE", 0.0, "", None, 0.0, 1, 0, 1.0, 20.0, shown)
    return replace(good, **more)


def step(*shown: Configuration | None, since: float | None = None, now: float = 0.0, **first):
    """Return what to do next, with the cells so."""
    rows = {name: row(name, each) for name, each in zip(CELLS, shown)}
    rows["m/a"] = replace(rows["m/a"], **first)
    return next_step(WANTED, CELLS, rows, since, WAIT_S, now)


def test_one_cell_first_then_the_rest_one_by_one() -> None:
    """Nobody else gets it before the first was well with it for long enough."""
    assert step(OWN, OWN, OWN)[0].cells == ("m/a",)
    assert step(TOLD, OWN, OWN)[0].do is Do.WAIT
    assert step(TRIED, OWN, OWN)[0].do is Do.WAIT
    waits, watch = step(RUNS, OWN, OWN, now=100.0)
    assert (waits.do, watch) == (Do.WAIT, 100.0)
    assert step(RUNS, OWN, OWN, since=100.0, now=159.0)[0].do is Do.WAIT
    next_one = step(RUNS, OWN, OWN, since=100.0, now=160.0)[0]
    assert (next_one.cells, next_one.text) == (("m/b",), "m/a is well with it: m/b")
    assert step(RUNS, TOLD, OWN, since=100.0, now=161.0)[0].cells == ("m/c",)
    assert step(RUNS, TOLD, RUNS, since=100.0, now=161.0)[0].text == (
        "wait for their next start: m/b"
    )
    assert step(RUNS, RUNS, RUNS, since=100.0, now=161.0)[0].do is Do.DONE


def test_a_single_cell_is_looked_at_as_long() -> None:
    """There is no rest to wait for it, but whoever asked wants to know."""
    rows = {"m/a": row("m/a", RUNS)}
    assert next_step(WANTED, CELLS[:1], rows, 0.0, WAIT_S, 59.0)[0].do is Do.WAIT
    assert next_step(WANTED, CELLS[:1], rows, 0.0, WAIT_S, 60.0)[0].do is Do.DONE


def test_a_cell_that_starts_anew_is_waited_for() -> None:
    """It is lost and silent for a while, with the change and before it is ready."""
    for shown in (TOLD, TRIED):
        for status in (LOST, SILENT):
            assert step(shown, OWN, OWN, status=status, level=Level.BAD)[0].do is Do.WAIT


def test_it_ends_where_a_cell_is_not_well() -> None:
    """Lost, silent or bad: the text says which and why."""
    bad = step(RUNS, OWN, OWN, level=Level.BAD, status="FAULT", text="SRVO-062")[0]
    assert (bad.do, bad.text) == (Do.END, "m/a is not well with it: FAULT, SRVO-062")
    assert step(RUNS, OWN, OWN, status=LOST)[0].do is Do.END
    assert step(OWN, OWN, OWN, status=LOST)[0].text == "m/a is lost"
    assert step(None, OWN, OWN)[0].text == "m/a says nothing of its configuration"
    gone = next_step(WANTED, CELLS, {"m/a": row("m/a", OWN)}, None, WAIT_S, 0.0)[0]
    assert (gone.do, gone.text) == (Do.END, "m/b is not there")


def test_a_note_ends_it_where_it_tells_of_this_try() -> None:
    """Of an earlier one it ends nothing: the same words could never be rolled out there again."""

    def said(shown: Configuration, asked: Configuration | None = None) -> tuple[Do, str]:
        rows = {name: row(name, each) for name, each in zip(CELLS, (shown, OWN, OWN))}
        before = {"m/a": asked} if asked is not None else {}
        found = next_step(WANTED, CELLS, rows, None, WAIT_S, 0.0, before)[0]
        return found.do, found.text

    left = Configuration(3, note=f"left {WANTED} by itself: the cell did not get ready")
    again = (Do.OFFER, "m/a first")
    assert said(left) == again
    # Its next health message tells that it has the change.
    assert said(left, left) == again
    ended = (Do.END, f"m/a went back: {left.note}")
    assert said(replace(left, number=5), left) == ended
    assert said(left, replace(TOLD, number=2)) == ended
    robot = Configuration(1, note=f"{WANTED} is for a, this cell has b: it waits for its robot")
    assert said(robot, TOLD) == (Do.END, f"m/a went back: {robot.note}")


def test_it_ends_where_somebody_takes_it_back() -> None:
    """Which is not what a cell still shows until its next health message."""
    asked = {"m/a": RUNS, "m/b": Configuration(3)}

    def said(b: Configuration) -> tuple[Do, str]:
        rows = {name: row(name, each) for name, each in zip(CELLS, (RUNS, b, OWN))}
        found = next_step(WANTED, CELLS, rows, 0.0, WAIT_S, 60.0, asked)[0]
        return found.do, found.text

    assert said(Configuration(3)) == (Do.OFFER, "m/a is well with it: m/b")
    assert said(replace(TOLD, number=4)) == (Do.OFFER, "m/a is well with it: m/c")
    assert said(Configuration(5)) == (Do.END, "m/b went back: own files")
    assert said(Configuration(5, WANTED)) == (
        Do.END,
        f"m/b went back: {WANTED}, next start: own files",
    )


@pytest.mark.parametrize(
    ("b", "c", "ill", "said"),
    [
        (OWN, OWN, "m/b", "waits for m/b, which is not well: FAULT, SRVO-062"),
        (RUNS, OWN, "m/b", "waits for m/b, which is not well: FAULT, SRVO-062"),
        (OWN, OWN, "m/c", "m/a is well with it: m/b"),
        (TRIED, OWN, "m/b", "m/a is well with it: m/c"),
        (RUNS, RUNS, "m/b", "3 cells run with it"),
    ],
)
def test_no_later_cell_gets_it_beside_one_that_is_not_well(
    b: Configuration, c: Configuration, ill: str, said: str
) -> None:
    """Neither while it is the next one's turn, nor while another may have a fault of it."""
    rows = {name: row(name, each) for name, each in zip(CELLS, (RUNS, b, c))}
    rows[ill] = replace(rows[ill], level=Level.BAD, status="FAULT", text="SRVO-062")
    assert next_step(WANTED, CELLS, rows, 0.0, WAIT_S, 60.0)[0].text == said


def test_cells_are_grouped_by_what_differs() -> None:
    """Those with their own files come last."""
    rows = [row("m/a", OWN), row("m/b", RUNS), row("m/c", TOLD), row("m/d", RUNS)]
    assert alike(rows) == [
        Alike(f"own files, next start: {WANTED}", ["m/c"]),
        Alike(WANTED, ["m/b", "m/d"]),
        Alike("own files", ["m/a"]),
    ]
