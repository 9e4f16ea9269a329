"""A person is who brings the token of a place that only they read."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from harness.workspace import ROOT
from scara_config import ConfigError
from scara_ros.page.persons_io import Person, Persons, load_persons, person_token, person_tokens
from scara_ros.page.token_file_io import TokenError

FITTER = Person("TOKEN_FITTER", "fitter_token", "operator")
FOREMAN = Person("TOKEN_FOREMAN", None, "operator")
TOKEN = "token-of-fitter-0123"


@pytest.fixture(autouse=True)
def _home(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("ROS_HOME", str(tmp_path))
    for person in (FITTER, FOREMAN):
        monkeypatch.delenv(person.token_environment, raising=False)


def test_shipped_person_is_the_operator_with_the_pages_token() -> None:
    """Who has only ever known one token goes on with it."""
    operator = load_persons(ROOT / "config")["operator"]
    assert (operator.token_environment, operator.token_file) == (
        "OPERATOR_PANEL_TOKEN",
        "operator_token",
    )


def test_token_is_that_of_the_environment_else_of_a_file_that_is_made(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Two nodes that start at once find the same one."""
    made = person_token(FITTER)
    assert (tmp_path / "fitter_token").stat().st_mode & 0o777 == 0o600
    assert Persons({"fitter": FITTER}).unproven("fitter", made) == ""
    monkeypatch.setenv(FITTER.token_environment, TOKEN)
    assert person_token(FITTER) == TOKEN
    assert person_token(FOREMAN) == ""


@pytest.mark.parametrize(
    ("name", "token", "why"),
    [
        ("", "", ""),
        ("fitter", TOKEN, ""),
        ("", TOKEN, "give the person's name"),
        ("fitter", "", "wrong token of fitter: it stands in the environment variable TOKEN_FITTER"),
        ("fitter", "x" * 18, "wrong token of fitter"),
        ("foreman", "", "no token of foreman is known here"),
        ("visitor", TOKEN, "person 'visitor' is not in persons.yaml: known are fitter, foreman"),
        ("x" * 1000, TOKEN, f"person '{'x' * 40}' is not in persons.yaml"),
    ],
)
def test_who_is_proven(monkeypatch: pytest.MonkeyPatch, name: str, token: str, why: str) -> None:
    """What happened and what to do; the token itself is never repeated."""
    monkeypatch.setenv(FITTER.token_environment, TOKEN)
    text = Persons({"fitter": FITTER, "foreman": FOREMAN}).unproven(name, token)
    assert why in text and bool(text) == bool(why)
    assert not token or token not in text


def test_token_that_was_made_anew_is_read_again_but_not_for_a_stop(tmp_path: Path) -> None:
    """A stop waits for no disk; the one before may have leaked, and is good no more."""
    file = tmp_path / "fitter_token"
    old = person_token(FITTER)
    persons = Persons({"fitter": FITTER})
    file.unlink()
    assert persons.unproven("fitter", old, read=False) == ""
    assert "wrong token" in persons.unproven("fitter", old)
    new = person_token(FITTER)
    assert new != old
    assert persons.unproven("fitter", new) == ""
    file.unlink()
    newer = person_token(FITTER)
    assert "wrong token" in persons.unproven("fitter", newer, read=False)
    assert persons.unproven("fitter", newer) == ""


def test_unusable_token_keeps_a_person_out_and_nobody_from_starting(tmp_path: Path) -> None:
    """The twin controller must run without any person: STOP needs none."""
    file = tmp_path / "fitter_token"
    file.write_text("token-of-fitter-0123")
    file.chmod(0o644)
    persons = Persons({"fitter": FITTER})
    assert "others can read it" in persons.trouble
    assert "others can read it" in persons.unproven("fitter", "token-of-fitter-0123")


def test_two_persons_with_one_token_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nobody could tell them apart."""
    for person in (FITTER, FOREMAN):
        monkeypatch.setenv(person.token_environment, TOKEN)
    with pytest.raises(TokenError, match="foreman has the token of somebody else"):
        person_tokens({"fitter": FITTER, "foreman": FOREMAN})


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("persons: {}", "persons"),
        ("persons: {'2 words': {}}", "persons"),
        ("persons: {fitter: {token: secret}}", "token"),
        ("people: {}", "people"),
    ],
)
def test_wrong_file_is_refused_with_its_key(tmp_path: Path, text: str, why: str) -> None:
    """A token in the file itself is an unknown key."""
    (tmp_path / "persons.yaml").write_text(text)
    with pytest.raises(ConfigError, match=why):
        load_persons(tmp_path)


@pytest.mark.parametrize(
    ("changes", "why"),
    [
        ({"foreman": {"local": True}}, "local of operator, foreman: allowed for one person"),
        ({"operator": {"token_file": None}}, "persons.operator.local: needs a token_file"),
    ],
)
def test_local_programs_are_one_persons_who_owns_a_token_file(
    tmp_path: Path, changes: dict[str, dict[str, object]], why: str
) -> None:
    """Else a line in a shell would be two persons, or one that nobody can prove."""
    one = {"token_environment": "A", "token_file": "a", "gateway_role": "operator"}
    operator = {**one, "local": True, **changes.get("operator", {})}
    foreman = {**one, **changes.get("foreman", {})}
    content = {"persons": {"operator": operator, "foreman": foreman}}
    (tmp_path / "persons.yaml").write_text(json.dumps(content))
    with pytest.raises(ConfigError, match=why):
        load_persons(tmp_path)


def test_programs_of_this_machine_are_the_shipped_operators_own() -> None:
    """Of nobody, where no person is said to be here."""
    assert Persons(load_persons(ROOT / "config")).local == "operator"
    assert Persons({"fitter": FITTER}).local == ""
