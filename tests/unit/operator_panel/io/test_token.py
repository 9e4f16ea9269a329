"""The operator's token is nobody else's."""

from __future__ import annotations

from pathlib import Path

import pytest
from operator_panel.io.token import FILE, VARIABLE, TokenError, is_token, operator_token


@pytest.fixture(autouse=True)
def _no_token_around(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(VARIABLE, raising=False)


def test_token_is_made_once_in_a_file_only_its_owner_reads(tmp_path: Path) -> None:
    """The second start finds the first one's."""
    first = operator_token("", tmp_path / "new")
    assert len(first) >= 20 and operator_token("", tmp_path / "new") == first
    assert (tmp_path / "new" / FILE).stat().st_mode & 0o777 == 0o600


def test_two_folders_have_two_tokens(tmp_path: Path) -> None:
    """It is drawn, not computed."""
    assert operator_token("", tmp_path / "a") != operator_token("", tmp_path / "b")


def test_given_token_goes_before_the_environments_and_that_before_the_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And then no file is made."""
    monkeypatch.setenv(VARIABLE, "around")
    assert operator_token("given", tmp_path) == "given" and operator_token("", tmp_path) == "around"
    assert list(tmp_path.iterdir()) == []


def test_file_that_others_can_read_is_refused(tmp_path: Path) -> None:
    """Its token may be known."""
    operator_token("", tmp_path)
    (tmp_path / FILE).chmod(0o644)
    with pytest.raises(TokenError, match="others can read it"):
        operator_token("", tmp_path)


def test_empty_file_is_refused(tmp_path: Path) -> None:
    """An empty token would fit an empty cookie."""
    operator_token("", tmp_path)
    (tmp_path / FILE).write_text("\n")
    with pytest.raises(TokenError, match="is empty"):
        operator_token("", tmp_path)


@pytest.mark.parametrize(
    ("offered", "fits"), [("secret", True), ("secre", False), ("", False), ("s\N{LATIN SMALL LETTER E WITH ACUTE}", False)]
)
def test_only_the_token_fits(offered: str, fits: bool) -> None:
    """Whatever a browser sends."""
    assert is_token(offered, "secret") == fits
