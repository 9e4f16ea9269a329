"""Each job runs once, an interrupted lab goes on where it was, and an experiment repeats itself."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from random import Random

import msgspec
import pytest
from farm.lab.plan import Plan, jobs_of
from farm.lab.results_io import MADE_BY, LabError, begin, read_plan, result_of
from farm.lab.running_io import made_by
from harness.machines.lab_project import JOBS, STEADY, Lab

PLAN = Plan("judge", ("1,2,3",), (), 8, 5.0, None, 0)


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Lab]:
    """Give all tests one project with a scheduler and a worker."""
    made = Lab(tmp_path_factory.mktemp("lab"))
    made.judge(STEADY)
    made.work_here()
    yield made
    made.stage.close()


def test_each_job_runs_once_and_again_only_if_it_has_no_result(lab: Lab) -> None:
    """Results come in the order of the plan."""
    log, folder = lab.folder / "ran.log", lab.folder / "once"
    lab.judge(f"open({str(log)!r}, 'a').write('x'); print(sys.argv[1]); sys.exit(3)")
    first = lab.run("once", code=1)
    jobs = jobs_of(read_plan(folder), Random)
    assert [said.strip() for said in lab.said("once")] == [job.words[0] for job in jobs]
    found = result_of(folder, jobs[4])
    assert found is not None and found.code == 3
    (folder / f"{jobs[4].name}.json").write_text('{"job": "')
    assert lab.run("once", code=1) == first
    assert len(log.read_text()) == JOBS + 1
    assert result_of(folder, jobs[4]) == found


def test_a_job_that_is_killed_runs_once_more(lab: Lab) -> None:
    """And one that is killed again is told so; the others are all there."""
    mark = lab.folder / "mark"
    lab.judge(
        f"first = not os.path.exists({str(mark)!r}); open({str(mark)!r}, 'w')\n"
        "first |= sys.argv[1].startswith('0.9')\n"
        "first and os.kill(os.getpid(), signal.SIGKILL)\nprint('done')\n"
    )
    words = ("judge", "0.5,0.1,0.1", "0.9,0.1,0.1", "0.5,0.2,0.1")
    results = lab.run("killed", words=words, code=1).splitlines()
    assert [msgspec.json.decode(each)["code"] for each in results] == [0, -9, 0]
    assert lab.said("killed") == ["done\n", "", "done\n"]


def test_a_folder_holds_one_plan(tmp_path: Path) -> None:
    """So that results of two are never mixed."""
    begin(tmp_path, PLAN, "version 1")
    begin(tmp_path, PLAN, "version 1")
    assert read_plan(tmp_path) == PLAN
    with pytest.raises(LabError, match="is another plan"):
        begin(tmp_path, msgspec.structs.replace(PLAN, seed=1), "version 1")
    with pytest.raises(LabError, match="is no plan of the lab"):
        read_plan(tmp_path / "nothing")
    for name in ("plan.json", "0000_0000.json"):
        (tmp_path / name).write_bytes(b'{"kind": "\xff"}')
    with pytest.raises(LabError, match="is no plan of the lab"):
        read_plan(tmp_path)
    # A result that cannot be read was not run.
    assert result_of(tmp_path, jobs_of(PLAN, Random)[0]) is None


def test_a_folder_holds_results_of_one_version_robot_and_plant(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Else those of another would be returned as its own. A folder of before goes on."""
    monkeypatch.setenv("CELL_ROOT", str(tmp_path))
    folder = tmp_path / "results"
    begin(folder, PLAN, first := made_by())
    begin(folder, PLAN, made_by())
    monkeypatch.setenv("SCARA_PLANT", "soft")
    assert made_by() == f"{first}, SCARA_PLANT soft"
    said = f"results are of {first}, more would be of {made_by()}: name another folder"
    with pytest.raises(LabError, match=said):
        begin(folder, PLAN, made_by())
    (tmp_path / "src").mkdir()
    (tmp_path / "src" / "one.py").touch()
    assert not made_by().startswith(first)
    (folder / MADE_BY).unlink()
    begin(folder, PLAN, made_by())


@pytest.mark.thorough
def test_an_experiment_repeats_itself_and_says_where_it_does_not(lab: Lab) -> None:
    """As a person does it, also on another scheduler: one of its own."""
    lab.judge(STEADY)
    lab.run("steady")
    folder = str(lab.folder / "steady")
    code, text = lab.say("again", folder)
    assert code == 0 and f"{JOBS} of {JOBS} results are the same" in text
    lab.judge(f"{STEADY}\nprint(os.getpid())\n")
    code, text = lab.say("again", folder, *lab.here)
    assert code == 1 and f"0 of {JOBS} results are the same" in text
    for wrong in (("judge", "x", "--speed", "9-1"), ("again", str(lab.folder))):
        assert lab.say(*wrong)[0] == 2
