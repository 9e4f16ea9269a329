"""The fixture ``ros`` itself: its nodes see its master and namespace, and nothing outlives a test."""

import pytest
from harness.processes import Stage, wait_until
from harness.ros import Ros
from std_msgs.msg import String
from std_srvs.srv import Empty


def test_a_message_published_by_a_tool_arrives_in_the_namespace(ros: Ros) -> None:
    """Relative names of started processes and of the test meet in one namespace."""
    ros.run("rostopic", "rostopic", "pub", "-r", "20", "greeting", "std_msgs/String", "data: hello")
    assert ros.wait_for_message("greeting", String).data == "hello"
    assert ros.name("greeting") in ros.shell("rostopic", "list")


def test_a_node_that_dies_fails_the_wait_with_its_output(ros: Ros) -> None:
    """A wait does not sit out its deadline when the node that should answer is gone."""
    ros.run("rostopic", "rostopic", "no_such_verb")
    with pytest.raises(AssertionError, match="ended with"):
        ros.wait_for_service("never", timeout=30.0)


def test_a_missing_service_is_named(ros: Ros) -> None:
    """The failure says which service was waited for."""
    with pytest.raises(AssertionError, match=f"service {ros.namespace}/never"):
        ros.service("never", Empty, timeout=0.3)


def test_a_grandchild_in_another_session_is_found_and_ended(ros: Ros) -> None:
    """Left-overs are found by their environment, whatever process group they fled to."""
    stage = Stage(ros.folder / "inner", ros.env)
    stage.start("setsid", "--fork", "sleep", "1000").wait()
    wait_until(lambda: [line for line in stage.left_over() if line.endswith(" sleep 1000")], 20.0)
    with pytest.raises(AssertionError, match=r"left behind.*sleep 1000"):
        stage.close()
    assert stage.left_over() == []
