"""gateway.yaml: the shipped file loads, wrong ones are refused.

The text names file, key, value and what is allowed.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from rosbridge_gateway.config import load_gateway_config
from scara_config import ConfigError

SHIPPED = Path(__file__).parents[3] / "config" / "gateway.yaml"


@pytest.fixture
def with_change(tmp_path: Path) -> Callable[[str, str], Path]:
    """Return the folder of a changed copy of the shipped file."""

    def change(old: str, new: str) -> Path:
        text = SHIPPED.read_text(encoding="utf-8")
        assert old in text
        (tmp_path / "gateway.yaml").write_text(text.replace(old, new, 1), encoding="utf-8")
        return tmp_path

    return change


def test_shipped_file_serves_this_machine_only() -> None:
    """Nothing is reachable from outside unless somebody decides so."""
    config = load_gateway_config(SHIPPED.parent)
    assert (config.host, config.port) == ("127.0.0.1", 9090)
    assert config.roles["viewer"].publish == [] and config.loopback_role == "operator"
    assert config.page_role == "viewer"


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        ("port: 9090", "port: 90900", r"gateway.yaml: port = 90900: .*<= 65535"),
        ("port: 9090", "prt: 9090", "unknown field `prt`"),
        ("port: 9090 ", "", "missing required field `port`"),
        (
            "loopback_role: operator",
            "loopback_role: king",
            "loopback_role = 'king': allowed: viewer, operator, twin_controller, or empty",
        ),
        (
            "page_role: viewer",
            "page_role: king",
            "page_role = 'king': allowed: viewer, operator, twin_controller, or empty",
        ),
        (
            "http://localhost:*",
            "http://localhost*",
            r"origins: 'http://localhost\*': allowed: scheme://host, scheme://host:port",
        ),
        (
            "longest_delay: 30.0",
            "longest_delay: 0.1",
            "guesses: allowed: first_delay = 0.5 <= longest_delay = 0.1 < forgotten_after = 600.0",
        ),
        (
            "tls_key: null",
            "tls_key: key.pem",
            "tls_certificate and tls_key: give both files, or null for both",
        ),
        (
            "service_timeout: 60.0",
            "service_timeout: 601.0",
            "service_timeout = 601.0: allowed: at most service_timeout_max",
        ),
        ("ping_timeout: 30.0", "ping_timeout: 0", "ping_timeout = 0: .*>= 0.05"),
        (
            "roles: [twin_controller]",
            "roles: [king]",
            "driving.roles: 'king': allowed: viewer, operator, twin_controller",
        ),
        ("nesting: 32", "nesting: deep", "limits.nesting = 'deep': Expected `int`"),
    ],
)
def test_wrong_file_is_refused(
    with_change: Callable[[str, str], Path], old: str, new: str, text: str
) -> None:
    """The node ends with this text."""
    with pytest.raises(ConfigError, match=text):
        load_gateway_config(with_change(old, new))
