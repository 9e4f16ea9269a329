"""``./cell farm invite | join | certificates | revoke | leave``, as a person types them."""

from __future__ import annotations

import stat
from datetime import datetime, timezone
from pathlib import Path

import farm.desk.lines.machines_io  # noqa: F401  it adds its words
import pytest
from farm.desk.command_line_io import app
from farm.security.invitation_io import read_invitation
from farm.security.lab_authority_io import LabAuthority
from harness.workspace import ROOT
from typer.testing import CliRunner


@pytest.fixture
def say(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> object:
    """Type words in a folder, with keys of its own; return exit code and all that was said."""
    monkeypatch.setenv("FARM_KEYS", str(tmp_path / "keys"))
    monkeypatch.setenv("SCARA_CONFIG_DIR", str(ROOT / "config"))
    monkeypatch.chdir(tmp_path)

    def run(*words: str) -> tuple[int, str]:
        result = CliRunner().invoke(app, list(words))
        return result.exit_code, result.output

    return run


def test_from_invitation_to_revocation(say, tmp_path: Path) -> None:  # type: ignore[no-untyped-def]
    """Each word says what to do next."""
    code, text = say("invite", "pc_2")
    assert code == 2 and "give --address HOST[:PORT]" in text
    code, text = say("invite", "pc_2", "--address", "hall-pc")
    assert code == 0 and "join pc_2.invitation" in text and "at hall-pc:7448 for 90 days" in text
    code, text = say("join", "pc_2.invitation")
    assert code == 0 and "joined site site as machine pc_2; desk: hall-pc:7448" in text
    code, text = say("cells")
    assert code == 1 and "it shows its cells and asks nobody" in text.replace("\n", " ")
    code, text = say("certificates")
    assert code == 0 and "pc_2" in text and "1 invited, 1 may come in" in text
    code, text = say("revoke", "pc_2")
    assert code == 0 and "puts it out within 2 seconds" in text
    assert "1 invited, 0 may come in" in say("certificates")[1]
    assert say("leave") == (0, "left: cells join the desk of this machine again\n")
    assert say("leave") == (0, "nothing was joined\n")


def test_all_is_renewed_by_one_word(say, tmp_path: Path) -> None:  # type: ignore[no-untyped-def]
    """Farm and lab; each machine gets a file of its own, for its owner's eyes."""
    for words in (("pc_2",), ("lap", "--desk"), ("pc_2", "--lab", "--file", "lab_before")):
        assert say("invite", *words, "--address", "hall-pc")[0] == 0
    assert say("revoke", "lap")[0] == 0
    code, text = say("renew", "--all")
    assert code == 2 and "give --address HOST[:PORT]" in text and "do it again" in text
    code, text = say("renew", "--all", "--address", "hall-pc")
    assert code == 0 and "2 new invitations" in text and "Nothing of before counts" in text
    files = sorted((tmp_path / "renewed").iterdir())
    assert [file.name for file in files] == ["pc_2.invitation", "pc_2.lab.invitation"]
    assert {stat.S_IMODE(file.stat().st_mode) for file in files} == {0o600}
    ports = {file.name: read_invitation(file).port for file in files}
    assert ports == {"pc_2.invitation": 7448, "pc_2.lab.invitation": 8786}
    for file in files:
        assert say("join", str(file))[0] == 0
    assert "3 invited, 2 may come in" in say("certificates")[1]


def test_who_is_revoked_in_the_lab_is_left_behind(say, tmp_path: Path) -> None:  # type: ignore[no-untyped-def]
    """By another authority: the others join again, by files for their owner's eyes."""
    for name in ("pc_2", "pc_3"):
        assert say("invite", name, "--lab", "--address", "hall-pc")[0] == 0
    code, text = say("revoke", "pc_2", "--lab")
    assert code == 2 and "give --address HOST[:PORT]" in text and "pc_2 is still let in" in text
    LabAuthority(tmp_path / "keys" / "lab", "site", datetime.now(timezone.utc)).listened("hall", 1)
    before = read_invitation(tmp_path / "pc_2.invitation").authority
    code, text = say("revoke", "pc_2", "--lab")
    assert code == 0 and "the lab's keys are new" in text and "1 new invitations" in text
    (file,) = (tmp_path / "renewed").iterdir()
    assert (file.name, stat.S_IMODE(file.stat().st_mode)) == ("pc_3.lab.invitation", 0o600)
    assert read_invitation(file).authority != before
    assert "2 invited, 1 may come in" in say("certificates")[1]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("invite", "a/b", "--address", "h"), "machine = 'a/b'"),
        (("invite", "pc_2", "--address", "0.0.0.0"), "at which other machines reach this one"),
        (("revoke", "pc_2"), "was not invited; there are: none"),
        (("join", "missing"), "No such file"),
        (("join", "damaged"), "is no invitation to a farm"),
        (("--listen", "::"), "--listen"),
        (("renew",), "renew --all: all is made anew. For one machine alone: ./cell farm invite"),
    ],
)
def test_wrong_words_end_with_the_reason(  # type: ignore[no-untyped-def]
    say, tmp_path: Path, words: tuple[str, ...], said: str
) -> None:
    """Exit code 2; nothing was made."""
    (tmp_path / "damaged").write_bytes(b'{"site": "\xff"}')
    code, text = say(*words)
    assert code == 2 and said in text, text
