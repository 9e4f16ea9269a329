"""Jobs run side by side, each once, and an interrupted lab goes on where it was."""

from __future__ import annotations

import sys
from pathlib import Path
from random import Random

import msgspec
import pytest
from farm.lab.command_line_io import app
from farm.lab.plan import Job, Plan, jobs_of
from farm.lab.running_io import LabError, begin, read_plan, result_of, run
from typer.testing import CliRunner

PLAN = Plan("judge", ("1,2,3",), (), 8, 5.0, None, 0)
JOBS = jobs_of(PLAN, Random)


def program(text: str) -> list[str]:
    """Return a program that writes down that it ran, and does something."""
    return [sys.executable, "-c", f"import os, signal, sys; {text}"]


def test_each_job_runs_once_and_again_only_if_it_has_no_result(tmp_path: Path) -> None:
    """Results come in the order of the plan, however many run at a time."""
    begin(tmp_path, PLAN)
    log = tmp_path / "ran.log"

    def command(job: Job) -> list[str]:
        return program(f"open({str(log)!r}, 'a').write('x'); print({job.name!r}); sys.exit(3)")

    first = run(tmp_path, JOBS, command, 3)
    assert [r.said.strip() for r in first] == [job.name for job in JOBS]
    assert {r.code for r in first} == {3}
    (tmp_path / f"{JOBS[4].name}.json").write_text('{"job": "')
    assert run(tmp_path, JOBS, command, 2) == first
    assert len(log.read_text()) == len(JOBS) + 1
    assert result_of(tmp_path, JOBS[4]) == first[4]


def test_a_job_that_is_killed_runs_once_more(tmp_path: Path) -> None:
    """And one that is killed again is told so; the others are all there."""
    mark = tmp_path / "mark"
    once = f"first = not os.path.exists({str(mark)!r}); open({str(mark)!r}, 'w'); "
    kill = "os.kill(os.getpid(), signal.SIGKILL)"
    commands = [
        program(f"{once}first and {kill}; print('done')"),
        program(kill),
        program("print('done')"),
    ]
    results = run(tmp_path, JOBS[:3], lambda job: commands[JOBS.index(job)], 1)
    assert [r.code for r in results] == [0, -9, 0]
    assert results[0].said == results[2].said == "done\n"


def test_a_folder_holds_one_plan(tmp_path: Path) -> None:
    """So that results of two are never mixed."""
    begin(tmp_path, PLAN)
    begin(tmp_path, PLAN)
    assert read_plan(tmp_path) == PLAN
    with pytest.raises(LabError, match="is another plan"):
        begin(tmp_path, msgspec.structs.replace(PLAN, seed=1))
    with pytest.raises(LabError, match="is no plan of the lab"):
        read_plan(tmp_path / "nothing")
    with pytest.raises(LabError, match="No such file"):
        run(tmp_path, JOBS[:1], lambda job: ["/nowhere/program"], 1)


def test_an_experiment_repeats_itself_and_says_where_it_does_not(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As a person does it, with programs of its own in place of the workspace's."""
    place = tmp_path / "devel" / "lib" / "what_if"
    place.mkdir(parents=True)
    steady = f"#!{sys.executable}\nimport sys\nprint(sys.argv[1:])\n"
    (place / "judge").write_text(steady)
    (place / "judge").chmod(0o755)
    monkeypatch.setenv("CELL_ROOT", str(tmp_path))
    folder, cli = str(tmp_path / "lab"), CliRunner()
    words = ["judge", "0.5,0.1,0.1", "--variations", "4", "--seed", "3"]
    done = cli.invoke(app, [*words, "--folder", folder])
    assert done.exit_code == 0 and "4 jobs: 4 ended with 0" in done.output
    done = cli.invoke(app, ["again", folder])
    assert done.exit_code == 0 and "4 of 4 results are the same" in done.output
    (place / "judge").write_text(f"{steady}import os\nprint(os.getpid())\n")
    done = cli.invoke(app, ["again", folder])
    assert done.exit_code == 1 and "0 of 4 results are the same" in done.output
    for wrong in (["judge", "x", "--speed", "9-1"], ["again", str(tmp_path)]):
        assert cli.invoke(app, wrong).exit_code == 2
