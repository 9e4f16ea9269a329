"""Who may command: one operator holds control, the others ask for it.

Each call takes the state and returns the next.
"""

from __future__ import annotations

from enum import StrEnum

import msgspec


class Role(StrEnum):
    """What a page may do at all."""

    OPERATOR = "operator"
    VIEWER = "viewer"


class Authority(msgspec.Struct, frozen=True):
    """Who holds control and who asks for it; ids of pages, times monotonic [s].

    Attributes:
        holder: Page in control, or an empty text.
        asker: Page that asks for it, or an empty text.
        asked: When it asked.
        left: When the holder's page was lost; None while it is there.
    """

    holder: str = ""
    asker: str = ""
    asked: float = 0.0
    left: float | None = None


def ask(state: Authority, page: str, role: Role, now: float) -> Authority:
    """Take control if it is free, else ask its holder, one question at a time. Viewers may not."""
    if role is not Role.OPERATOR or page == state.holder:
        return state
    if not state.holder:
        return Authority(holder=page)
    if state.asker and state.asker != page:
        return state
    return msgspec.structs.replace(state, asker=page, asked=now if not state.asker else state.asked)


def answer(state: Authority, page: str, granted: bool) -> Authority:
    """Let the holder grant or keep control; anybody else changes nothing."""
    if page != state.holder or not state.asker:
        return state
    return Authority(holder=state.asker) if granted else msgspec.structs.replace(state, asker="")


def release(state: Authority, page: str) -> Authority:
    """Give control up; who asks gets it."""
    if page == state.asker:
        return msgspec.structs.replace(state, asker="")
    return Authority(holder=state.asker) if page == state.holder else state


def lost(state: Authority, page: str, now: float) -> Authority:
    """Note that a page is gone; the holder's may come back for a while."""
    if page == state.asker:
        return msgspec.structs.replace(state, asker="")
    if page == state.holder and state.left is None:
        return msgspec.structs.replace(state, left=now)
    return state


def returned(state: Authority, page: str) -> Authority:
    """Note that a page is there again."""
    return msgspec.structs.replace(state, left=None) if page == state.holder else state


def passed(state: Authority, now: float, answer_s: float, return_s: float) -> Authority:
    """Let time pass: a holder who does not answer or does not come back loses control."""
    gone = state.left is not None and now - state.left > return_s
    unanswered = bool(state.asker) and now - state.asked > answer_s
    return Authority(holder=state.asker) if gone or unanswered else state


def refusal(state: Authority, page: str, role: Role) -> str:
    """Return why ``page`` may not begin a motion, or an empty text; anybody may end one."""
    if role is not Role.OPERATOR:
        return "this page only watches: open the operator's address, the one with a token"
    if page != state.holder:
        return (
            "another operator is in control: ask for it" if state.holder else "take control first"
        )
    return ""


def inherited(state: Authority, old: str, new: str) -> Authority:
    """Let a page that was loaded again keep what its former self held."""
    if state.holder != old:
        return state
    return msgspec.structs.replace(
        state, holder=new, left=None, asker="" if state.asker == new else state.asker
    )
