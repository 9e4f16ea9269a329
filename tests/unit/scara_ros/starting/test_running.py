"""``--help`` says what a node's source declares, and starts nothing."""

from __future__ import annotations

import pytest
from scara_ros.interface import interface_of
from scara_ros.starting.running_node import help_of, run

SOURCE = """
import rospy
from std_msgs.msg import Float64, String as Text
from std_srvs.srv import Trigger
from scara_ros.services.service_client_node import ServiceClient

STATE, ASKED = "node/state", "other/ask"
SIDES = ("twin", "real")
RATE = 25.0

def main():
    rospy.Publisher(STATE, Text, queue_size=1)
    for joint in joints():
        name = f"twin/{joint}"
        subscribe(f"{name}/command", Float64, print)
    [rospy.Subscriber(f"{side}/parts", Text, print) for side in SIDES]
    ServiceClient(ASKED, Trigger, 1.0)
    for word in ("start", "stop"):
        rospy.Service(f"node/{word}", Trigger, print)
    rospy.get_param("~rate", RATE), rospy.get_param("~file", None), rospy.has_param("~url")
    rospy.get_param("/use_sim_time", False)
    print("no/topic", 3)
    rospy.Publisher(known_later, Text)
"""


def test_declarations_are_found_by_name_and_type() -> None:
    """Constants, loops over written lists and assigned names are followed."""
    found = interface_of([SOURCE])
    assert found.publishes == {"node/state": "std_msgs/String"}
    assert found.subscribes == {
        "real/parts": "std_msgs/String",
        "twin/<joint>/command": "std_msgs/Float64",
        "twin/parts": "std_msgs/String",
    }
    assert found.calls == {"other/ask": "std_srvs/Trigger"}
    assert found.offers == {"node/start": "std_srvs/Trigger", "node/stop": "std_srvs/Trigger"}
    assert found.parameters == {"~file": "", "~rate": "25.0", "~url": ""}


def test_help_is_the_docstring_the_usage_and_the_tables() -> None:
    """Modules that a node imports from a folder ``nodes`` count too."""
    text = help_of("cell_recorder.recording.recorder_node")
    assert text.startswith("Node recorder: one recording per run")
    assert "usage: rosrun cell_recorder recorder [_PARAMETER:=VALUE ...]" in text
    assert "\n  ~directory\n" in text
    assert "\n  /diagnostics  diagnostic_msgs/DiagnosticArray\n" in text
    assert "\n  recorder/start  scara_msgs/StartRecording\n" in text


@pytest.mark.parametrize("word", ["--help", "-h"])
def test_help_starts_nothing_and_exits_with_0(
    word: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Without the word the node runs."""
    started = []

    def main() -> None:
        started.append("main")

    main.__module__ = "cell_recorder.recording.recorder_node"
    monkeypatch.setattr("sys.argv", ["recorder", "_directory:=x", word])
    with pytest.raises(SystemExit) as ended:
        run(main)
    assert ended.value.code == 0 and not started
    assert "usage: rosrun cell_recorder recorder" in capsys.readouterr().out
    monkeypatch.setattr("sys.argv", ["recorder", "_directory:=x"])
    run(main)
    assert started == ["main"]
