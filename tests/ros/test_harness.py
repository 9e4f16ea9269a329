"""The fixture ``ros`` itself.

Its nodes see its master and namespace, and nothing outlives a test.
"""

from pathlib import Path

import pytest
from harness.processes import ROSRUN, Stage, wait_until, without_rosrun
from harness.ros import Ros


def test_rosrun_finds_what_the_harness_finds_without_it(ros: Ros) -> None:
    """The harness starts nodes by their file, which saves time; rosrun comes to the same one."""
    direct = without_rosrun(["rosrun", "fanuc_emulator", "emulator", "_port:=0"], ros.env)
    assert len(direct) == 2 and Path(direct[0]).is_file()
    by_rosrun = ros.stage.start(ROSRUN, "fanuc_emulator", "emulator", "_port:=0")
    by_harness = ros.stage.start("rosrun", "fanuc_emulator", "emulator", "_port:=0")
    assert by_harness.command == direct
    assert by_rosrun.wait(20.0) == by_harness.wait(20.0) == 2
    assert by_rosrun.output == by_harness.output != ""


def test_a_node_that_dies_fails_the_wait_with_its_output(ros: Ros) -> None:
    """A wait does not sit out its deadline when the node that should answer is gone."""
    ros.run("rostopic", "rostopic", "no_such_verb")
    with pytest.raises(AssertionError, match="ended with"):
        ros.wait_for_service("never", timeout=30.0)


def test_a_process_whose_log_was_taken_away_is_reported_all_the_same(ros: Ros) -> None:
    """Whatever took it away: the report of the other processes must come."""
    process = ros.stage.start("sh", "-c", "exit 3")
    process.wait()
    process.log.unlink()
    assert "(exit code 3)" in ros.stage.report()


def test_a_grandchild_in_another_session_is_found_and_ended(ros: Ros) -> None:
    """Left-overs are found by their environment, whatever process group they fled to."""
    stage = Stage(ros.folder / "inner", ros.env)
    stage.start("setsid", "--fork", "sleep", "1000").wait()
    # Before it has fled its command line still begins with setsid.
    wait_until(
        lambda: [line.split(" ", 1)[1] for line in stage.left_over()] == ["sleep 1000"], 20.0
    )
    with pytest.raises(AssertionError, match=r"left behind.*sleep 1000"):
        stage.close()
    assert stage.left_over() == []
