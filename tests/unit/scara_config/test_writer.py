"""Changing a YAML file keeps everything that was not asked to change."""

from __future__ import annotations

from pathlib import Path

import pytest
from harness.yaml_files import shipped
from scara_config import ConfigError
from scara_config.files.whole_file import OWNER_ONLY, whole_file, write_whole
from scara_config.writer import DROPPED, Noted, changed_text, replace_file, write_values

TEXT = """\
# gains of the twin
joint_1:                 # first
  position: {p: 8285.0, i: 82850.0, d: 276.2}   # by hand
joint_2:
  position: {p: 1.0, i: 2.0, d: 3.0}
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """Return a file with comments and an order of its own."""
    path = tmp_path / "gains.yaml"
    path.write_text(TEXT)
    return path


def test_only_the_value_changes(file: Path) -> None:
    """Comments, order and flow style stay."""
    write_values(file, {("joint_1", "position", "p"): 9000.0})
    assert file.read_text() == TEXT.replace("8285.0", "9000.0")


def test_a_missing_key_is_added(file: Path) -> None:
    """New sections may be written."""
    text = changed_text(file, {("joint_3", "position", "p"): 5.0})
    assert text.startswith(TEXT) and "joint_3:" in text


def test_nothing_but_the_file_is_left_in_the_folder(file: Path) -> None:
    """The temporary file becomes the file."""
    write_values(file, {("joint_2", "position", "d"): 4.0})
    assert [path.name for path in file.parent.iterdir()] == ["gains.yaml"]


def test_a_key_below_a_number_is_refused(file: Path) -> None:
    """The path of a key must lead through mappings."""
    with pytest.raises(ConfigError, match=r"joint_1.position.p.x: p is no mapping"):
        changed_text(file, {("joint_1", "position", "p", "x"): 1.0})


def test_a_missing_file_is_said(tmp_path: Path) -> None:
    """The text names the file."""
    with pytest.raises(ConfigError, match=r"none.yaml: cannot be read"):
        changed_text(tmp_path / "none.yaml", {})


def test_a_failed_write_leaves_the_old_file(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A full disk costs the change, never the file."""
    import os

    def full(_: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(ConfigError, match=r"cannot be written: No space left on device"):
        replace_file(file, "new")
    assert file.read_text() == TEXT
    assert [path.name for path in file.parent.iterdir()] == ["gains.yaml"]


@pytest.mark.parametrize(
    "name", ["pid_gains.yaml", "simulation.yaml", "twin_controller.yaml", "robot.yaml"]
)
def test_writing_nothing_changes_nothing_in_our_files(name: str) -> None:
    """A proposal shows only what it changes."""
    path = shipped(name)
    assert changed_text(path, {}) == path.read_text()


def test_a_protected_file_is_not_replaced(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Renaming needs only the folder; the file's own protection counts as well."""
    import os

    monkeypatch.setattr(os, "access", lambda *_: False)
    with pytest.raises(ConfigError, match=r"cannot be written: Permission denied"):
        write_values(file, {("joint_2", "position", "d"): 4.0})
    assert file.read_text() == TEXT


def test_a_symbolic_link_stays_one(file: Path) -> None:
    """What it points to is changed."""
    link = file.with_name("link.yaml")
    link.symlink_to(file)
    write_values(link, {("joint_2", "position", "d"): 4.0})
    assert link.is_symlink()
    assert "d: 4.0" in file.read_text()


def test_a_file_that_could_not_be_ended_is_as_it_was(tmp_path: Path) -> None:
    """Nothing of the half stays behind."""
    file = tmp_path / "kept"
    write_whole(file, b"old", OWNER_ONLY)
    with pytest.raises(ZeroDivisionError), whole_file(file, half=".part") as stream:
        stream.write(b"new")
        assert [path.suffix for path in tmp_path.glob("*.part")] == [".part"]
        raise ZeroDivisionError
    assert file.read_bytes() == b"old" and list(tmp_path.iterdir()) == [file]
    assert file.stat().st_mode & 0o777 == OWNER_ONLY


def test_a_value_is_written_with_its_comment_and_another_goes(tmp_path: Path) -> None:
    """Lines of comment below both stay, and the comment stands where the old one did."""
    path = tmp_path / "robot.yaml"
    path.write_text(
        "stops:\n  hold: here   # once\n  # between\n  imstp: here  # too\n# below\nb: 1\n"
    )
    changes = {("stops", "hold"): Noted("there", "today"), ("stops", "imstp"): DROPPED}
    assert changed_text(path, changes) == (
        "stops:\n  hold: there  # today\n  # between\n# below\nb: 1\n"
    )


@pytest.mark.parametrize(
    ("dropped", "left"),
    [
        (["a"], "  b: 2\n  # about c\n  c: 3  # eol c\n"),
        (["a", "b"], "  # about c\n  c: 3  # eol c\n"),
    ],
)
def test_comments_below_a_first_key_that_goes_stay_above_the_next(
    dropped: list[str], left: str, tmp_path: Path
) -> None:
    """They are about that, not about the end of the mapping."""
    path = tmp_path / "first.yaml"
    path.write_text(
        "m:\n  # above a\n  a: 1  # eol a\n  # about b\n  b: 2\n  # about c\n  c: 3  # eol c\n"
        "# about n\nn: 1\n"
    )
    assert changed_text(path, {("m", key): DROPPED for key in dropped}) == (
        f"m:\n  # above a\n  # about b\n{left}# about n\nn: 1\n"
    )
