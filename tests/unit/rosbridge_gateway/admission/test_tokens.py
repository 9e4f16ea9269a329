"""Tokens and the roles they give."""

from __future__ import annotations

import hmac

import pytest
from rosbridge_gateway.admission.tokens import UNGUESSABLE, Tokens

LONG = "x" * UNGUESSABLE
TOKENS = Tokens({"look": "viewer", LONG: "twin_controller", "drive": "operator"})


@pytest.mark.parametrize(
    ("offered", "role"),
    [("look", "viewer"), ("drive", "operator"), (LONG, "twin_controller")]
    + [(wrong, None) for wrong in ("", "loo", "look ", "LOOK", "\udcff", LONG[:-1])],
)
def test_token_gives_its_role(offered: str, role: str | None) -> None:
    """The whole token, nothing else."""
    assert TOKENS.role(offered) == role


def test_after_wrong_tokens_only_those_that_nobody_guesses_count() -> None:
    """The twin controller's made one: a guesser on its machine cannot keep it out."""
    assert TOKENS.role(LONG, only_unguessable=True) == "twin_controller"
    assert TOKENS.role("drive", only_unguessable=True) is None


def test_every_token_is_compared_in_constant_time(monkeypatch: pytest.MonkeyPatch) -> None:
    """Neither which one fitted nor how much of it, nor its length, shows in the time."""
    compared: list[tuple[int, int]] = []

    def compare(one: bytes, other: bytes) -> bool:
        compared.append((len(one), len(other)))
        return one == other

    monkeypatch.setattr(hmac, "compare_digest", compare)
    for offered in ("look", "drive", "", "x" * 1000):
        TOKENS.role(offered)
    assert compared == [(32, 32)] * 12
