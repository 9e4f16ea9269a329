"""The rosbridge clients that are tried, and their scripts in tests/clients/rosbridge."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from harness.clients.environments import OWN, Environment, installed


class Client(NamedTuple):
    """A client's environment, what it runs, and how many checks that has."""

    environment: Environment
    scripts: tuple[str, ...]
    checks: int


def rosbridge_clients() -> Iterator[Client]:
    """Yield them: the project's own roslibpy, with `./cell test --clients` all."""
    roslibpy = ("roslibpy_examples.py",)
    for environment in installed("roslibpy_*") or [OWN]:
        yield Client(environment, roslibpy, 16)
    for environment in installed("roslibjs_*"):
        yield Client(environment, ("roslibjs_examples.mjs",), 19)
    player = ("player", "hooks", "workspace")
    for environment in installed("foxglove_player*"):
        more = tuple(f"foxglove_{part}.mjs" for part in player)
        yield Client(environment, ("foxglove_examples.mjs", *more), 8)
    for environment in installed("ros_mcp*"):
        yield Client(environment, ("ros_mcp_examples.py",), 13)
