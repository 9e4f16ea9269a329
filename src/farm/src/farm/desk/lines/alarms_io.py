"""``./cell farm alarms | acknowledge | shelve``: the desk's alarms as text."""

from __future__ import annotations

import time
from datetime import datetime
from typing import Annotated

import msgspec
import typer
from scara_ros.shell.program_io import FAILED

from farm import keys
from farm.desk.alarm_desk_io import ACKNOWLEDGE, SHELVE, MarksAsked
from farm.desk.alarms import AlarmRow, AlarmStatus
from farm.desk.command_line_io import (
    CONNECT_S,
    Person,
    RouterPort,
    app,
    configured,
    desk_name,
    fail,
    open_session,
    person_name,
    print_table,
)
from farm.wire import Answer, decode, encode

Id = Annotated[str, typer.Argument(help='Of the alarm, as listed: "MACHINE/CELL: SOURCE".')]


@app.command()
def alarms(router_port: RouterPort = None) -> None:
    """List alarms: raised ones first, then those that went unseen, acknowledged, shelved."""
    rows = _show(router_port)
    waiting = sum(row.status in (AlarmStatus.RAISED, AlarmStatus.CLEARED) for row in rows)
    typer.echo(f"{len(rows)} alarms, {waiting} wait for somebody")


@app.command()
def acknowledge(alarm: Id, router_port: RouterPort = None, person: Person = None) -> None:
    """Say that you have looked at an alarm; one that has gone leaves the list then."""
    _mark(ACKNOWLEDGE, alarm, router_port, person)


@app.command()
def shelve(
    alarm: Id,
    hours: Annotated[float, typer.Option(help="For how long; 0: take it off the shelf.")] = 1.0,
    why: Annotated[str, typer.Option(help="Reason, for those who ask later.")] = "",
    router_port: RouterPort = None,
    person: Person = None,
) -> None:
    """Put an alarm out of the way for a time, with a reason; it comes back by itself."""
    _mark(SHELVE, alarm, router_port, person, 3600.0 * hours, why)


def _show(router_port: int | None, alarm: str | None = None) -> list[AlarmRow]:
    """Print all alarms, or the one of this id, and return what was shown."""
    rows = msgspec.json.decode(_answered(router_port, keys.ALARMS), type=list[AlarmRow])
    shown = [row for row in rows if alarm in (None, row.id)]
    names = ("alarm", "level", "status", "since", "times", "text", "by", "until")
    print_table(names, [_line(row) for row in shown])
    return shown


def _mark(
    word: str,
    alarm: str,
    router_port: int | None,
    person: str | None,
    seconds: float = 0.0,
    why: str = "",
) -> None:
    """Show an alarm as it is now, and mark what was shown."""
    shown = _show(router_port, alarm)
    if not shown:
        fail(f"{alarm}: is not listed; ./cell farm alarms lists what there is", FAILED)
    asked = MarksAsked(word, [row.seen for row in shown], seconds, why)
    question = f"{keys.MARK}?person={person_name(person)}@{desk_name()}"
    answer = decode(_answered(router_port, question, encode(asked)), Answer)
    if not answer.accepted:
        fail(answer.text, FAILED)
    typer.echo(answer.text)


def _answered(router_port: int | None, question: str, payload: bytes | None = None) -> bytes:
    """Return what the desk answers first; end the program if it does not answer."""
    config = configured(router_port)
    with open_session(config) as session:
        selector = f"{config.site}/{question}"
        for reply in session.get(selector, payload=payload, timeout=CONNECT_S):
            if reply.ok is not None:
                return bytes(reply.ok.payload)
    fail("the desk does not answer, though its router is there", FAILED)


def _line(row: AlarmRow) -> tuple[object, ...]:
    until = datetime.fromtimestamp(row.until).strftime("%H:%M") if row.until else ""
    seconds = f"{max(0.0, time.time() - row.raised):.0f} s ago"
    text = f"{row.text} ({row.why})" if row.why else row.text
    return (row.id, row.level, row.status.value, seconds, row.times, text, row.person, until)
