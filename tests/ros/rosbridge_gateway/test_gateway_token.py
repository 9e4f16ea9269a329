"""The twin controller at a gateway that asks for a token and speaks TLS."""

from __future__ import annotations

import pytest
from harness.opponents.secured_gateway import write_certificate
from harness.ros import Ros
from harness.yaml_files import changed_yaml, copy_configuration, shipped

TOKEN = "drive-7f3a"


def test_secured_gateway_lets_the_twin_controller_in(ros: Ros) -> None:
    """Both nodes by their files alone; the token is nowhere but in their environment."""
    folder = copy_configuration(ros.folder / "config")
    certificate, key = write_certificate(ros.folder)
    for name, value in (("tls_certificate", certificate), ("tls_key", key), ("loopback_role", "")):
        changed_yaml(folder / "gateway.yaml", folder, [name], value)
    variable = "SCARA_TWIN_CONTROLLER_TOKEN"
    for name, value in (("token_environment", variable), ("ca_file", certificate)):
        changed_yaml(folder / "twin_controller.yaml", folder, ["twin", name], value)
    port, where = ros.free_port(), f"_config_dir:={folder}"
    gateway = ros.run(
        "rosbridge_gateway", "gateway", where, f"_port:={port}", env={variable: TOKEN}
    )
    ros.wait_until(lambda: f"on 127.0.0.1:{port}" in gateway.output, 20.0, "the gateway's port")
    ends = (f"_gateway_url:=wss://127.0.0.1:{port}", f"_modbus_port:={ros.free_port()}")
    node = ros.run("twin_controller", "twin_controller", where, *ends, env={variable: TOKEN})
    ros.wait_until(lambda: "link twin: connected" in node.output, 20.0, "the link")
    assert "came as twin_controller" in gateway.output
    assert TOKEN not in node.output + gateway.output


@pytest.mark.parametrize(
    ("key", "value", "text"),
    [
        (
            "token_environment",
            "NO_SUCH_TOKEN",
            "twin.token_environment = NO_SUCH_TOKEN: the variable is not set",
        ),
        (
            "url",
            "ws://127.0.0.1:9090/?token=secret",
            "twin.url = ws://127.0.0.1:9090/?...: must have no query",
        ),
    ],
)
def test_token_that_cannot_be_used_ends_the_node(ros: Ros, key: str, value: str, text: str) -> None:
    """Exit code 2, one line, and nothing of it published."""
    folder = copy_configuration(ros.folder / "config")
    changed_yaml(shipped("twin_controller.yaml"), folder, ["twin", key], value)
    node = ros.run("twin_controller", "twin_controller", f"_config_dir:={folder}")
    assert node.wait(20.0) == 2
    assert text in node.output and "Traceback" not in node.output and "secret" not in node.output
