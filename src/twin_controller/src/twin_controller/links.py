"""Which link limits and which robot are in force, in words and in the recorded file."""

from __future__ import annotations

import re

from twin_controller.config import TwinControllerConfig


def recorded_choices(text: str, config: TwinControllerConfig) -> str:
    """Return the text of twin_controller.yaml with the choices in force, as it is recorded.

    The robot's address decides whether it may be led, so a replay needs it.
    """
    text = re.sub(r"^  host:\s*\S+", f"  host: {config.real.host}", text, count=1, flags=re.M)
    line = f"links: {config.links}"
    said, count = re.subn(r"^links:\s*\w+", line, text, count=1, flags=re.MULTILINE)
    if count or config.links == "strict":
        return said
    return f"{text.rstrip()}\n{line}\n"


def links_text(config: TwinControllerConfig) -> str:
    """Say which link limits are in force, for the log."""
    return (
        f"link limits: {config.links}; robot: answer {config.real.timeout_ms:g} ms,"
        f" data {config.real.stale_ms:g} ms; twin: data {config.twin.stale_ms:g} ms"
    )
