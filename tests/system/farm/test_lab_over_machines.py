"""The lab over three machines in network namespaces, with slow and lossy lines between them."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator

import pytest
from harness.machines.far_lab import POINTS, SLOW, FarLab
from harness.machines.namespaces import Machines, missing
from harness.workspace import ROOT

PROGRAM = "config/robots/fanuc_sr6ia/programs/ARTICLE.LS"
pytestmark = [
    pytest.mark.system,
    pytest.mark.thorough,
    pytest.mark.skipif(bool(missing()), reason=f"network namespaces: {missing()}"),
]


@pytest.fixture(scope="module")
def far(tmp_path_factory: pytest.TempPathFactory) -> Iterator[FarLab]:
    """Give all tests one lab."""
    with Machines(2, SLOW) as machines:
        made = FarLab(tmp_path_factory.mktemp("far"), machines)
        try:
            made.open()
            yield made
        finally:
            made.close()


def test_points_are_judged_alike_on_two_other_machines(far: FarLab) -> None:
    """With 20 ms and 1 % loss both ways, bit for bit."""
    here = far.labs[0].run("points_here", words=POINTS)
    assert far.far("points_far", POINTS) == here and here.count(b"\n") == 12
    assert all(json.loads(line)["code"] == 0 for line in here.splitlines())


def test_files_of_the_desk_are_there_by_their_content(far: FarLab) -> None:
    """A program's file, and a recording that is none: what is said of it names the desk's file."""
    own = far.labs[0].folder / "own programs"
    own.mkdir()
    program, broken = own / "ARTICLE.LS", own / "run.bag"
    shutil.copyfile(ROOT / PROGRAM, program)
    broken.write_bytes(b"no bag" * 2_000_000)
    for name, words, code in (
        ("program", ("judge", str(program)), 0),
        ("bag", ("replay", str(broken)), 1),
    ):
        here = far.labs[0].run(f"{name}_here", words=words, code=code)
        assert far.far(f"{name}_far", words, code) == here
    assert str(broken) in json.loads(here)["complained"]


def test_a_worker_that_is_killed_on_another_machine_loses_nothing(far: FarLab) -> None:
    """Killed with SIGKILL in the middle of a job, on both: all results are there, the same ones."""
    here = far.labs[0].run("killed_here", words=POINTS)
    asked = far.begin("killed_far", POINTS)
    for number in (1, 2):
        far.kill_a_job_with_its_worker(number)
    assert asked.wait(120.0) == 0, asked.tail()
    assert far.labs[0].results("killed_far") == here


def test_a_machine_that_is_cut_off_loses_nothing(far: FarLab) -> None:
    """Its line is cut while it has a job; the other one does what it had. The last of this lab."""
    here = far.labs[0].run("cut_here", words=POINTS)
    asked = far.begin("cut_far", POINTS)
    far.cut_during_a_job(1)
    assert asked.wait(120.0) == 0, asked.tail()
    assert far.labs[0].results("cut_far") == here
