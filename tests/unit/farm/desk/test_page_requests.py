"""What a browser sends to the desk's page: what is no request is refused in words."""

from __future__ import annotations

import asyncio
import json
import threading
from concurrent.futures import ThreadPoolExecutor
from types import SimpleNamespace

import pytest
from anyio.to_thread import current_default_thread_limiter
from farm.desk import page_io
from farm.desk.commands_io import Answered
from farm.desk.page_io import Page, PageRequest
from farm.desk.roster import Roster
from farm.keys import CellName
from farm.wire import Answer
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request

NONE = [b"", b"{", b'{"cell": "\xff", "command": "STOP"}', b"[" * 100_000, b'{"cell": 1}']


def request(body: bytes) -> Request:
    """Return a request whose body has come."""

    async def receive() -> dict[str, object]:
        return {"type": "http.request", "body": body, "more_body": False}

    return Request({"type": "http", "method": "POST", "headers": []}, receive)


@pytest.mark.parametrize("body", NONE, ids=["nothing", "half", "no UTF-8", "deep", "other"])
@pytest.mark.parametrize("asked", ["_command", "_mark"])
def test_what_is_no_request_is_refused_before_anything_is_done(asked: str, body: bytes) -> None:
    """A page without a desk: nothing of it is touched."""
    page = object.__new__(Page)
    answer = asyncio.run(getattr(page, asked)(request(body)))
    assert answer.status_code == 400 and answer.body


HERE, LOST = CellName("site", "m", "a"), CellName("site", "m", "b")


def test_a_stop_of_all_names_whom_it_did_not_reach(monkeypatch: pytest.MonkeyPatch) -> None:
    """Behind the answers of those that are there; who stops one cell asks for no other."""
    roster = Roster(1.0)
    roster.remember(LOST, 1.0)
    answer = Answer(True, "STOP received")
    monkeypatch.setattr(
        page_io, "order", lambda _, cells, *__: [Answered(cell, answer, 0.1) for cell in cells]
    )
    page = object.__new__(Page)
    page._desk = SimpleNamespace(session=None, rows=lambda: roster.rows(2.0))  # type: ignore[assignment]
    page._site, page._who, page._expiry_s = "site", ("ann", "desk"), 2.0

    def answers(cell: str, *there: CellName) -> list[tuple[bool, str]]:
        monkeypatch.setattr(page_io, "cells_there", lambda *_: list(there))
        lines = map(json.loads, page._answers(PageRequest("STOP", cell)))
        return [(line["good"], line["text"]) for line in lines]

    good = (True, "m/a: STOP received (100 ms)")
    away = (False, "m/b: NOT REACHED: use the STOP at the cell")
    assert answers("all", HERE) == [good, away]
    assert answers("all") == [(False, "no cell is there"), away]
    assert answers("a", HERE) == [good]


def test_a_stop_goes_out_while_all_other_requests_wait(monkeypatch: pytest.MonkeyPatch) -> None:
    """As for a disk that hangs: commands have threads of their own."""
    free, page = threading.Event(), object.__new__(Page)
    page._commands = ThreadPoolExecutor(1)
    monkeypatch.setattr(page, "_answers", lambda asked: iter([asked.command.encode()]))

    async def stop() -> tuple[list[bytes], bool]:
        loop, begun = asyncio.get_running_loop(), asyncio.Event()

        def hang() -> None:
            loop.call_soon_threadsafe(begun.set)
            free.wait(10.0)

        current_default_thread_limiter().total_tokens = 1
        other = asyncio.create_task(run_in_threadpool(hang))
        await begun.wait()
        answer = await page._command(request(b'{"command": "STOP", "cell": "all"}'))
        lines = [line async for line in answer.body_iterator]
        waits = not other.done()
        free.set()
        await other
        return lines, waits

    assert asyncio.run(stop()) == ([b"STOP"], True)
