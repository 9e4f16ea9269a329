"""Two persons and a program without one at the twin controller's services."""

from __future__ import annotations

from pathlib import Path

from harness.ros import Ros
from harness.yaml_files import changed_yaml, copy_configuration

ANNA, BEN = "token-of-anna-0123", "token-of-ben-45678"
STRANGERS = (
    {},
    {"person": "ben", "token": BEN},
    {"person": "anna", "token": "wrong"},
    {"person": "nobody", "token": "wrong"},
)


def configuration(folder: Path) -> Path:
    """Write a configuration with two persons, whose tokens the environment holds."""
    copy_configuration(folder)
    persons = {
        name: {"token_environment": f"TOKEN_{name}", "token_file": None, "gateway_role": "operator"}
        for name in ("anna", "ben")
    }
    changed_yaml(folder / "persons.yaml", folder, ["persons"], persons)
    return changed_yaml(folder / "twin_controller.yaml", folder, ["control", "keep_ms"], 2000.0)


def test_two_persons_share_control_and_stop_needs_none(ros: Ros) -> None:
    """Held, refused, stopped, asked, given, lost; names and no token in audit, why and state."""
    from scara_msgs.msg import Audit, Decision, TwinControllerState
    from scara_msgs.srv import Control, TwinCommand, Why

    audits = ros.collect("twin_controller/audit", Audit)
    states = ros.collect("twin_controller/state", TwinControllerState)
    decisions = ros.collect("twin_controller/decisions", Decision)
    node = ros.run(
        "twin_controller",
        "twin_controller",
        f"_config_dir:={configuration(ros.folder / 'config')}",
        f"_modbus_port:={ros.free_port()}",
        f"_gateway_url:=ws://127.0.0.1:{ros.free_port()}",
        env={"TOKEN_anna": ANNA, "TOKEN_ben": BEN},
    )
    control = ros.service("twin_controller/control", Control)
    command = ros.service("twin_controller/command", TwinCommand)
    why = ros.service("twin_controller/why", Why)
    ros.wait_until(lambda: bool(states), 10.0, "a state")

    assert "a link is down" in command(command="HOME").message, "free: judged by the mode"
    assert "wrong token of anna" in control(action="TAKE", person="anna", token=BEN).message
    taken = control(action="TAKE", person="anna", token=ANNA, session="7")
    assert taken.success and taken.holder == "anna 7"
    ros.wait_until(lambda: states[-1].holder == "anna 7", 5.0, "the holder in the state")
    for who in STRANGERS:
        refused = command(command="HOME", **who)
        assert not refused.success and "a link is down" not in refused.message
        for name in ("STOP", "ESTOP"):
            assert command(command=name, **who).success
        assert "holds control" not in command(command="PAUSE", **who).message
    mine = command(command="HOME", person="anna", token=ANNA, session="7")
    assert "holds control" not in mine.message, "judged by the mode again"

    assert control(action="ASK", person="ben", token=BEN).success
    ros.wait_until(lambda: states[-1].asker == "ben", 5.0, "the asker in the state")
    assert control(action="GIVE", person="anna", token=ANNA, session="7").holder == "ben"
    ros.wait_until(lambda: states[-1].holder == "", 10.0, "silence that loses control")

    by = {(decision.event, decision.who) for decision in decisions}
    assert by >= {
        ("CONTROL_TAKEN", "anna 7"),
        ("CONTROL_GIVEN", "anna 7"),
        ("CONTROL_LOST", ""),
        ("ESTOP", "anna, not proven"),
        ("ESTOP", "ben"),
        ("STOP", "this machine"),
    }
    assert any("[by anna 7]" in line for line in why(count=100).decisions)
    told = " ".join(f"{audit.who} {audit.what} {audit.outcome}" for audit in audits)
    assert "anna 7 by /" in told and "nobody, not proven by /" in told
    assert ANNA not in told + node.output and BEN not in told + node.output
