"""A page's token is nobody else's."""

from __future__ import annotations

from pathlib import Path

import pytest
from scara_ros.page.page_token_io import address, page_token, refuse_token_in
from scara_ros.page.token_file_io import TokenError

VARIABLE = "PAGE_TOKEN_OF_THE_TESTS"


@pytest.fixture(autouse=True)
def _no_token_around(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(VARIABLE, raising=False)


def test_token_is_made_once_in_a_file_only_its_owner_reads(tmp_path: Path) -> None:
    """The second start finds the first one's."""
    file = tmp_path / "new" / "token"
    first = page_token(VARIABLE, file)
    assert len(first) >= 20 and page_token(VARIABLE, file) == first
    assert file.stat().st_mode & 0o777 == 0o600


def test_two_files_have_two_tokens(tmp_path: Path) -> None:
    """It is drawn, not computed."""
    assert page_token(VARIABLE, tmp_path / "a") != page_token(VARIABLE, tmp_path / "b")


def test_the_environments_token_goes_before_the_files(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And then no file is made."""
    monkeypatch.setenv(VARIABLE, "around-around-around")
    assert page_token(VARIABLE, tmp_path / "token") == "around-around-around"
    assert list(tmp_path.iterdir()) == []


def test_token_on_the_command_line_is_refused_and_the_right_places_are_said(tmp_path: Path) -> None:
    """Everybody on the machine sees it there; rospy tells it to the parameter server too."""
    file = tmp_path / "token"
    refuse_token_in(["_port:=8080", "__name:=x"], VARIABLE, file)
    with pytest.raises(TokenError, match=rf"can read it\. Set {VARIABLE}, or .* into .*/token"):
        refuse_token_in(["_port:=8080", "_token:=secret"], VARIABLE, file)


@pytest.mark.parametrize("token", ["short", "fifteen-letters", "a blank in between", "p&ss" * 8])
def test_token_that_can_be_guessed_or_breaks_an_address_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, token: str
) -> None:
    """Guesses run at hundreds a second: sixteen signs take longer than there is time."""
    monkeypatch.setenv(VARIABLE, token)
    with pytest.raises(TokenError, match=rf"{VARIABLE}: the token has {len(token)} signs"):
        page_token(VARIABLE, tmp_path / "token")


def test_file_that_others_can_read_is_refused(tmp_path: Path) -> None:
    """Its token may be known."""
    page_token(VARIABLE, tmp_path / "token")
    (tmp_path / "token").chmod(0o644)
    with pytest.raises(TokenError, match="others can read it"):
        page_token(VARIABLE, tmp_path / "token")


def test_empty_file_is_refused(tmp_path: Path) -> None:
    """An empty token would be everybody's."""
    page_token(VARIABLE, tmp_path / "token")
    (tmp_path / "token").write_text("\n")
    with pytest.raises(TokenError, match="is empty: delete it to get a new one"):
        page_token(VARIABLE, tmp_path / "token")


@pytest.mark.parametrize(
    ("host", "token", "shown"),
    [
        ("127.0.0.1", "", "http://127.0.0.1:8080/"),
        ("127.0.0.1", "abc", "http://127.0.0.1:8080/?token=abc"),
        ("::1", "abc", "http://[::1]:8080/?token=abc"),
    ],
)
def test_address_can_be_opened(host: str, token: str, shown: str) -> None:
    """As a browser wants it."""
    assert address(host, 8080, token) == shown
