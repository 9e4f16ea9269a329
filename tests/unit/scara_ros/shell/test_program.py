"""What all programs share at their edges."""

from __future__ import annotations

import io
from pathlib import Path

import pytest
from scara_ros.shell.program_io import (
    command_of,
    ends_with,
    link_latest,
    new_run_folder,
    private_parameters,
    require_library,
    runs_folder,
    say,
    without_remappings,
)


@pytest.mark.parametrize(
    ("error", "code", "said"),
    [
        (FileNotFoundError("no bag"), 3, "replay: no bag\n"),
        (ValueError("speed = 0"), 2, "replay: speed = 0\n"),
        (KeyboardInterrupt(), 130, "replay: interrupted\n"),
    ],
)
def test_an_error_is_one_line_and_its_exit_code(
    error: BaseException, code: int, said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """The kind of an error counts, its subclasses included."""
    with (
        pytest.raises(SystemExit) as ended,
        ends_with("replay", {ValueError: 2, OSError: 3, KeyboardInterrupt: 130}),
    ):
        raise error
    assert ended.value.code == code
    assert capsys.readouterr().err == said


def test_the_first_kind_that_fits_counts() -> None:
    """So a special error may end a program in another way than its general one."""
    with pytest.raises(SystemExit) as ended, ends_with("x", {UnicodeError: 1, ValueError: 2}):
        raise UnicodeError("bytes")
    assert ended.value.code == 1


def test_an_error_that_nobody_expects_stays_what_it_is() -> None:
    """A fault of the program shows its traceback."""
    with pytest.raises(ZeroDivisionError), ends_with("x", {ValueError: 2}):
        raise ZeroDivisionError


def test_a_thread_goes_on_though_nobody_reads_what_it_says() -> None:
    """What it watches is watched also where its output went to a program that has ended."""

    class Gone(io.StringIO):
        def write(self, _: str) -> int:
            raise BrokenPipeError

    say("lost", Gone())


def test_words_of_ros_are_parameters_or_nothing() -> None:
    """A value may hold the mark; a word without it is the program's own."""
    words = ["a.bag", "_config_dir:=/tmp/a:=b", "_", "twin/x:=y", "__name:=z"]
    assert private_parameters(words) == {"config_dir": "/tmp/a:=b", "_name": "z"}
    assert without_remappings(words) == ["a.bag", "_"]


def test_runs_are_in_the_workspace(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Unless they are given; outside of a workspace in the working folder."""
    monkeypatch.setenv("CELL_ROOT", "/cell")
    assert runs_folder("") == Path("/cell/runs") and runs_folder("/other") == Path("/other")
    monkeypatch.delenv("CELL_ROOT")
    monkeypatch.chdir(tmp_path)
    assert runs_folder() == tmp_path / "runs"


def test_a_library_that_is_there_is_nothing_to_say(capsys: pytest.CaptureFixture[str]) -> None:
    """And the program goes on."""
    require_library("json", "run")
    assert capsys.readouterr().err == ""


def test_a_missing_library_ends_the_program_with_what_to_do(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """One line, the program's name in front, and the exit code that the program promises."""
    monkeypatch.setattr("sys.argv", ["/ws/devel/lib/what_if/judge", "ARTICLE"])
    with pytest.raises(SystemExit) as ended:
        require_library("no_such_library", "run", code=3)
    assert ended.value.code == 3
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("judge: the library no_such_library is not installed")
    assert line.endswith("To install it: ./cell setup run")


def test_latest_follows_the_newest_run(tmp_path: Path) -> None:
    """The link is relative, so that the folder can be moved."""
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        link_latest(tmp_path / name)
        assert (tmp_path / "latest").readlink() == Path(name)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a", "b", "latest"]


def test_a_real_folder_called_latest_is_left_alone(tmp_path: Path) -> None:
    """Somebody's data are not replaced by a link, and the run is good without it."""
    (tmp_path / "latest").mkdir()
    link_latest(tmp_path / "a")
    assert not (tmp_path / "latest").is_symlink()
    assert [path.name for path in tmp_path.iterdir()] == ["latest"]


def test_node_is_found_where_rosrun_finds_it(tmp_path: Path) -> None:
    """The first workspace wins, what cannot be executed does not count, the rest is rosrun's."""
    for workspace, mode in (("plain", 0o644), ("first", 0o755), ("second", 0o755)):
        script = tmp_path / workspace / "lib" / "package" / "node"
        script.parent.mkdir(parents=True)
        script.touch(mode)
    env = {
        "CMAKE_PREFIX_PATH": ":".join(str(tmp_path / name) for name in ("plain", "first", "second"))
    }
    assert command_of("package", "node", env) == [
        str(tmp_path / "first" / "lib" / "package" / "node")
    ]
    assert command_of("package", "other", env) == ["rosrun", "package", "other"]
    assert command_of("package", "node", {}) == ["rosrun", "package", "node"]


def test_two_runs_in_one_second_get_two_folders(tmp_path: Path) -> None:
    """No run writes into another's folder."""
    first, second = new_run_folder(tmp_path / "runs", "s"), new_run_folder(tmp_path / "runs", "s")
    assert (first.name, second.name) == ("s", "s_2")
