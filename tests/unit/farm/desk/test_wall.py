"""What the page shows: fixed places, the worst, equal alarms as one, the operator page's words."""

from __future__ import annotations

from farm.desk.alarms import AlarmBook, AlarmStatus, SeenAlarm
from farm.desk.roster import Roster
from farm.desk.wall import AlarmGroup, Wall, wall_of
from farm.keys import CellName
from farm.wire import CellState, Event, Level

CELLS = [CellName("hall", machine, cell) for machine, cell in (("b", "milk"), ("a", "milk"))]
CELLS += [CellName("hall", "a", f"cell_{k}") for k in range(4)]


def alarm(
    number: int, source: str, text: str, level: str = "warning", active: bool = True
) -> Event:
    """Return an event of an alarm."""
    body = {"source": source, "level": level, "active": active, "text": text}
    return Event(number, float(number), "alarm", False, text, body)


def groups(book: AlarmBook) -> list[AlarmGroup]:
    """Return what the page shows of alarms."""
    return wall_of(100.0, [], book.rows(100.0), []).alarms


def test_cards_come_by_name_and_the_worst_by_how_bad_they_are() -> None:
    """A card's place does not tell how its cell is; the row of the worst does."""
    roster = Roster(2.0)
    for cell in CELLS:
        roster.alive(cell, 10.0)
        roster.shown(cell, CellState(1, 10.0, 1, Level.GOOD, "IDLE", remote=True), 10.0)
    roster.shown(CELLS[4], CellState(2, 11.0, 1, Level.WARN, "STOPPED"), 11.0)
    roster.shown(CELLS[2], CellState(2, 11.0, 1, Level.BAD, "ESTOP"), 11.0)
    roster.gone(CELLS[5], 11.0)
    wall = wall_of(11.5, roster.rows(11.5), [], [])
    assert [card.name for card in wall.cards] == sorted(str(cell) for cell in CELLS)
    assert wall.worst == ["a/cell_3", "a/cell_0", "a/cell_2"] and wall.lost == 1
    assert [card.short for card in wall.cards[-2:]] == ["a/milk", "b/milk"]
    told = {card.name: (card.title, card.facts) for card in wall.cards}
    assert told["a/cell_3"] == ("Lost", []) and "the farm may move it" in told["a/milk"][1]


def shown(state: CellState) -> Wall:
    """Return the wall of one cell."""
    roster = Roster(2.0)
    roster.alive(CELLS[0], 1.0)
    roster.shown(CELLS[0], state, 1.0)
    return wall_of(1.5, roster.rows(1.5), [], [])


def test_a_card_says_how_its_cell_is() -> None:
    """Reason without codes, distance, speed, who is in control; the tone is the worse one."""
    state = CellState(
        1,
        1.0,
        1,
        Level.BAD,
        "TWIN_LEADS",
        why="MOVE: TWIN_LEADS: the twin moves",
        holder="ann",
        speed_percent=80.0,
        deviation_mm=0.418,
        remote=True,
    )
    (card,) = shown(state).cards
    assert (card.title, card.tone, card.text) == ("Twin leads", "bad", "The twin moves")
    in_control = ["ann is in control", "the farm may move it"]
    assert card.facts == ["0.42 mm apart", "speed 80 %", *in_control]


def test_a_mode_that_is_bad_stays_bad_where_the_cell_says_warning() -> None:
    """Offline is red on the operator's page, and a warning of the link."""
    (card,) = shown(CellState(1, 1.0, 1, Level.WARN, "OFFLINE")).cards
    assert (card.title, card.tone) == ("Offline", "bad")


def test_equal_alarms_are_one_row_with_their_count_and_cells() -> None:
    """Another text, level or source is another row."""
    book = AlarmBook()
    for k, cell in enumerate(CELLS[2:5]):
        book.told(str(cell), alarm(k + 1, "real", "R[5] is slow"))
    book.told(str(CELLS[5]), alarm(4, "real", "R[5] is slow", level="error"))
    book.told(str(CELLS[5]), alarm(5, "fan", "R[5] is slow"))
    found = groups(book)
    assert [(g.source, g.level, g.cells) for g in found] == [
        ("real", "error", ["cell_3"]),
        ("fan", "warning", ["cell_3"]),
        ("real", "warning", ["cell_0", "cell_1", "cell_2"]),
    ]
    seen = [SeenAlarm(f"a/cell_{k}: real", k + 1.0, "warning") for k in range(3)]
    assert found[2].alarms == found[2].waiting == seen
    assert (found[2].raised, found[2].times, found[2].cleared) == (3.0, 3, 0.0)
    assert (found[2].until, found[2].marked) == (0.0, 0.0), "nobody has done anything to them"


def test_a_row_tells_who_has_looked_at_some_of_its_alarms() -> None:
    """It asks as long as one of them waits; its button is for those alone."""
    book = AlarmBook()
    for k, cell in enumerate(CELLS[2:5]):
        book.told(str(cell), alarm(k + 1, "real", "R[5] is slow"))
    book.read(book.acknowledge("a/cell_1: real", "ann@desk", 50.0))
    book.read(book.shelve("a/cell_2: real", "ben@desk", 60.0, 3600.0, "a part comes"))
    (group,) = groups(book)
    assert group.status is AlarmStatus.RAISED
    assert [alarm.id for alarm in group.waiting] == ["a/cell_0: real"]
    assert group.persons == ["ann@desk", "ben@desk"] and group.marked == 60.0
    assert (group.until, group.why) == (3660.0, ["a part comes"])
    assert wall_of(100.0, [], book.rows(100.0), []).waiting == 1
    for k, cell in enumerate(CELLS[2:5]):
        assert groups(book)[0].cleared == 0.0, "one is still there"
        book.told(str(cell), alarm(10 + k, "real", "", active=False))
    (group,) = groups(book)
    assert (group.status, group.cells, group.cleared) == (
        AlarmStatus.CLEARED,
        ["cell_0", "cell_2"],
        12.0,
    )


def test_a_row_says_when_the_first_of_its_shelved_alarms_comes_back() -> None:
    """Not before and not later: then it asks again."""
    book = AlarmBook()
    for k, (cell, hours) in enumerate(((CELLS[2], 2.0), (CELLS[3], 1.0))):
        book.told(str(cell), alarm(k + 1, "real", "R[5] is slow"))
        book.read(book.shelve(f"{cell}: real", "ben@desk", 60.0, hours * 3600.0, "a part comes"))
    (group,) = groups(book)
    assert (group.status, group.until) == (AlarmStatus.SHELVED, 3660.0)


def test_events_are_told_as_on_the_operators_page() -> None:
    """A decision by the titles of its modes; all else as the journal has it."""
    body = {"mode_before": "IDLE", "mode_after": "PAUSED"}
    body |= {"why": "PAUSE: by a person", "who": "ann"}
    events = [
        Event(4, 4.0, "decision", True, "IDLE -> PAUSED", body),
        Event(3, 3.0, "decision", False, "of an older journal"),
        alarm(2, "real", "R[5] is slow"),
        Event(1, 1.0, "cycle"),
    ]
    wall = wall_of(3.0, [], [], [("a/milk", event) for event in events])
    first, *others = (event.text for event in wall.events)
    assert first == "Ready → Paused: By a person, asked for by ann"
    assert others == ["of an older journal", "R[5] is slow", ""] and wall.unreadable == 0
