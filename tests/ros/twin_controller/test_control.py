"""Two persons and a program without one at the twin controller's services."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from harness.processes import Process
from harness.ros import Ros
from harness.wires.operator_page import TOKEN, VARIABLE, Panel, heard
from harness.yaml_files import changed_yaml, copy_configuration
from scara_ros.services.service_client_node import ServiceClient

FITTER, FOREMAN = "token-of-fitter-0123", "token-of-foreman-45678"
KEEP_MS = 1500.0
STRANGERS = (
    {},
    {"person": "foreman", "token": FOREMAN},
    {"person": "fitter", "token": "wrong"},
    {"person": "nobody", "token": "wrong"},
)


def configuration(folder: Path) -> Path:
    """Write a configuration with two persons, whose tokens the environment holds."""
    copy_configuration(folder)
    persons = {
        name: {"token_environment": f"TOKEN_{name}", "token_file": None, "gateway_role": "operator"}
        for name in ("fitter", "foreman")
    }
    changed_yaml(folder / "persons.yaml", folder, ["persons"], persons)
    return changed_yaml(folder / "twin_controller.yaml", folder, ["control", "keep_ms"], KEEP_MS)


def controller(ros: Ros, folder: Path, **env: str) -> Process:
    """Start a twin controller that has neither side."""
    return ros.run(
        "twin_controller",
        "twin_controller",
        f"_config_dir:={folder}",
        f"_modbus_port:={ros.free_port()}",
        f"_gateway_url:=ws://127.0.0.1:{ros.free_port()}",
        env=env,
    )


def test_two_persons_share_control_and_stop_needs_none(ros: Ros) -> None:
    """Held, refused, stopped, asked, given, lost; names and no token in audit, why and state."""
    from scara_msgs.msg import Audit, Decision, TwinControllerState
    from scara_msgs.srv import Control, TwinCommand, Why

    audits = ros.collect("twin_controller/audit", Audit)
    states = ros.collect("twin_controller/state", TwinControllerState)
    decisions = ros.collect("twin_controller/decisions", Decision)
    node = controller(
        ros, configuration(ros.folder / "config"), TOKEN_fitter=FITTER, TOKEN_foreman=FOREMAN
    )
    control = ros.service("twin_controller/control", Control)
    command = ros.service("twin_controller/command", TwinCommand)
    why = ros.service("twin_controller/why", Why)
    ros.wait_until(lambda: bool(states), 10.0, "a state")

    assert "a link is down" in command(command="HOME").message, "free: judged by the mode"
    assert "wrong token of fitter" in control(action="TAKE", person="fitter", token=FOREMAN).message
    taken = control(action="TAKE", person="fitter", token=FITTER, session="7")
    assert taken.success and taken.holder == "fitter 7"
    ros.wait_until(lambda: states[-1].holder == "fitter 7", 5.0, "the holder in the state")
    fitter = {"person": "fitter", "token": FITTER, "session": "7"}
    for who in STRANGERS:
        # A sign of life, as a page gives: on a busy machine the questions take their time.
        assert control(action="KEEP", **fitter).success
        refused = command(command="HOME", **who)
        assert not refused.success and "a link is down" not in refused.message
        for name in ("STOP", "ESTOP"):
            assert command(command=name, at_once=True, **who).sent
        assert "holds control" not in command(command="PAUSE", **who).message
    mine = command(command="HOME", person="fitter", token=FITTER, session="7")
    assert "holds control" not in mine.message, "judged by the mode again"

    assert control(action="KEEP", **fitter).success
    assert control(action="ASK", person="foreman", token=FOREMAN).success
    ros.wait_until(lambda: states[-1].asker == "foreman", 5.0, "the asker in the state")
    assert control(action="GIVE", person="fitter", token=FITTER, session="7").holder == "foreman"
    ros.wait_until(lambda: states[-1].holder == "", 10.0, "silence that loses control")

    wanted = {
        ("CONTROL_TAKEN", "fitter 7"),
        ("CONTROL_GIVEN", "fitter 7"),
        ("CONTROL_LOST", ""),
        ("ESTOP", "fitter, not proven"),
        ("ESTOP", "foreman"),
        ("STOP", "this machine"),
    }
    ros.wait_until(
        lambda: wanted <= {(decision.event, decision.who) for decision in list(decisions)},
        5.0,
        "all decisions",
    )
    assert any("[by fitter 7]" in line for line in why(count=100).decisions)
    told = " ".join(f"{audit.who} {audit.what} {audit.outcome}" for audit in audits)
    assert "fitter 7 by /" in told and "nobody, not proven by /" in told
    assert FITTER not in told + node.output and FOREMAN not in told + node.output


STRANGE = (
    "/gateway/operator@10.0.0.7",
    "/cell_2/gateway",
    "/farm/ann@desk_1",
    "/rosbridge_websocket",
)


def caller(kind: type, name: str, service: str) -> ServiceClient:
    """Return a client that calls in this name."""
    return ServiceClient(service, kind, 10.0, caller=name)


def test_page_in_control_keeps_it_until_it_is_closed(ros: Ros) -> None:
    """It keeps it by signs of life; a shell is the same person, clients of others wait."""
    from scara_msgs.msg import TwinControllerState
    from scara_msgs.srv import Control, TwinCommand

    folder = copy_configuration(ros.folder / "config")
    changed_yaml(folder / "twin_controller.yaml", folder, ["control", "keep_ms"], KEEP_MS)
    states = ros.collect("twin_controller/state", TwinControllerState)
    controller(ros, folder, **{VARIABLE: TOKEN})
    command = ros.service("twin_controller/command", TwinCommand)
    control = ros.service("twin_controller/control", Control)
    panel = Panel(ros, f"_config_dir:={folder}")
    with panel.live(panel.enter()) as live:
        ros.wait_until(
            lambda: heard(live, "frame")["text"]["mode"] != "No data", 20.0, "a state on the page"
        )
        live.send('{"hold": 1, "joint": "joint_1", "direction": 1, "percent": 3}')
        assert "a link is down" in heard(live, "refused")["why"]
        assert states[-1].holder == "", "a page that only watches"
        # As its first command would; that begins nothing without the sides.
        seat = {"person": "operator", "token": TOKEN, "session": "1"}
        assert control(action="TAKE", **seat).success
        ros.wait_until(lambda: states[-1].holder == "operator 1", 20.0, "the page in control")
        held = states[-1].held_since
        ros.wait_until(
            lambda: states[-1].header.stamp - held > rospy_duration(1.3e-3 * KEEP_MS),
            20.0,
            "signs of life",
        )
        assert states[-1].holder == "operator 1"
        assert abs((states[-1].held_since - held).to_sec()) < 0.5, "the same hold all the time"
        assert "a link is down" in command(command="HOME").message, "judged by the mode"
        for name in STRANGE:
            stranger = caller(TwinCommand, name, ros.name("twin_controller/command"))
            assert "operator 1 holds control" in stranger(command="HOME").message
        assert control(action="LEND", by="/rosservice").success
        for by in (*STRANGE, ""):
            assert "operator 1 holds control" in control(action="LEND", by=by).message
        stranger = caller(Control, STRANGE[0], ros.name("twin_controller/control"))
        assert not stranger(action="LEND", by="/rosservice").success
        live.send('{"stop": "STOP", "press": 1}')
        assert heard(live, "stopped")["confirmed"]
    ros.wait_until(lambda: states[-1].holder == "", 20.0, "a closed page that holds nothing")
    assert "holds control" not in command(command="HOME").message


def rospy_duration(seconds: float) -> Any:
    """Return a ROS duration."""
    import rospy

    return rospy.Duration(seconds)
