"""Typed content of farm.yaml."""

from __future__ import annotations

import ipaddress
from pathlib import Path
from typing import Annotated

import msgspec
from msgspec import Meta
from scara_config import ConfigError, load, locate

from farm.keys import NAME
from farm.link.rights import Rights

Name = Annotated[str, Meta(pattern=NAME)]
Port = Annotated[int, Meta(ge=1, le=65535)]
Rate = Annotated[float, Meta(ge=0.1, le=100.0)]
Milliseconds = Annotated[float, Meta(ge=100.0, le=60_000.0)]
LONGEST_EXPIRY_MS = 2000.0
"""Nothing that moves or stops a robot waits for longer on its way."""


class Address(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Where something listens."""

    host: str
    port: Port

    @property
    def endpoint(self) -> str:
        """As zenoh writes it."""
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"tcp/{host}:{self.port}"


class LinkConfig(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What the link in the cell sends, and what it lets the farm do."""

    state_rate_hz: Rate
    joints_rate_hz: Rate
    health_rate_hz: Rate
    silent_ms: Milliseconds
    answer_ms: Annotated[float, Meta(ge=100.0, lt=LONGEST_EXPIRY_MS)]
    events_limit: Annotated[int, Meta(ge=1, le=10_000)]
    remote_at_start: bool
    rights: Rights


class DeskConfig(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The desk: its page, its files, its patience."""

    host: str
    port: Port
    silent_ms: Milliseconds
    flush_ms: Annotated[float, Meta(ge=50.0, le=10_000.0)]
    small_files: Annotated[int, Meta(ge=2, le=10_000)]
    small_file_mb: Annotated[float, Meta(gt=0.0, le=1000.0)]
    expiry_ms: Annotated[float, Meta(ge=100.0, le=LONGEST_EXPIRY_MS)]
    recent_events: Annotated[int, Meta(ge=1, le=10_000)]
    planned_run_time_s: dict[str, Annotated[float, Meta(gt=0.0)]]


class FarmConfig(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """farm.yaml."""

    site: Name
    machine: Name | None
    router: Address
    lease_ms: Annotated[float, Meta(ge=200.0, le=60_000.0)]
    link: LinkConfig
    desk: DeskConfig


def load_farm(directory: Path | str | None = None) -> FarmConfig:
    """Read farm.yaml of ``directory`` (default: the package scara_config).

    Raises:
        ConfigError: The file is missing, a value does not fit, an address is not of this machine,
            or a person has a role that is not there.
    """
    file = locate("farm/farm.yaml", directory)
    config = load(file, FarmConfig)
    for key, host in (("router.host", config.router.host), ("desk.host", config.desk.host)):
        if why := loopback_refusal(host):
            raise ConfigError(f"{file}: {key} = {host}: {why}")
    for key, value, why in config.link.rights.faults():
        raise ConfigError(f"{file}: link.rights.{key} = {value}: {why}")
    return config


def loopback_refusal(host: str) -> str:
    """Return why nothing may listen or connect there, or an empty text.

    Example:
        >>> loopback_refusal("127.0.0.1"), loopback_refusal("localhost")
        ('', '')
        >>> loopback_refusal("0.0.0.0")
        'allowed is only this machine (127.0.0.1): the farm has no certificates (mTLS) yet'
    """
    try:
        if host == "localhost" or ipaddress.ip_address(host).is_loopback:
            return ""
    except ValueError:
        pass
    return "allowed is only this machine (127.0.0.1): the farm has no certificates (mTLS) yet"
