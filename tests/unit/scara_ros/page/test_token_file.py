"""Tokens of the environment, and of files that only their owner can read."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from scara_ros.page.token_file_io import TokenError, read_token


def read(home: Path, file: str | None = "t", **environment: str) -> str | None:
    """Read as a node of a user with this home does."""
    return read_token("TOKEN", file, {"HOME": str(home), **environment})


def test_missing_file_is_made_once_for_its_owner_only(tmp_path: Path) -> None:
    """Both nodes read the same, whoever comes first, and wherever their run keeps its files."""
    first = read(tmp_path)
    assert first is not None and len(first) >= 32
    assert read(tmp_path, ROS_HOME="/elsewhere") == first
    assert [f.name for f in (tmp_path / ".ros").iterdir()] == ["t"]
    assert (tmp_path / ".ros" / "t").stat().st_mode & 0o777 == 0o600


def test_nodes_that_start_at_once_agree(tmp_path: Path) -> None:
    """One of them makes the file; no reader finds it half written."""
    with ThreadPoolExecutor(8) as pool:
        assert len(set(pool.map(lambda _: read(tmp_path), range(50)))) == 1


def test_environment_counts_before_the_file(tmp_path: Path) -> None:
    """An empty variable is none, and then no file is needed."""
    assert read(tmp_path, TOKEN="given") == "given"
    assert not (tmp_path / ".ros").exists()
    assert read(tmp_path, None) is None and read(tmp_path, None, TOKEN="") is None
    assert read(tmp_path, TOKEN="") is not None


@pytest.mark.parametrize(
    ("content", "mode", "text"),
    [
        ("secret", 0o640, "others can read it: chmod 600, or delete it"),
        (" \n", 0o600, "is empty: delete it"),
        ("sécret", 0o600, "cannot be used: .*; or set TOKEN"),
    ],
)
def test_file_that_cannot_be_used_is_refused(
    tmp_path: Path, content: str, mode: int, text: str
) -> None:
    """The text says which file, why, and what to do, and not the token."""
    file = tmp_path / "t"
    file.write_text(content, encoding="utf-8")
    file.chmod(mode)
    with pytest.raises(TokenError, match=f"{file}: {text}") as caught:
        read(tmp_path, str(file))
    assert "secret" not in str(caught.value)


def test_folder_that_cannot_be_made_is_said(tmp_path: Path) -> None:
    """The node ends with this text."""
    (tmp_path / ".ros").write_text("a file")
    with pytest.raises(TokenError, match=r"cannot be used: .*; or set TOKEN"):
        read(tmp_path)
