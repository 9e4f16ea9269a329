"""What a browser sends to the desk's page: what is no request is refused in words."""

from __future__ import annotations

import asyncio

import pytest
from farm.desk.page_io import Page
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
