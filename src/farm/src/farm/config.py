"""Typed content of farm.yaml."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import msgspec
from msgspec import Meta
from scara_config import ConfigError, load, locate
from scara_config.quantities import BusRateHz, BusSilenceMs, Port, is_this_machine

from farm.keys import NAME
from farm.link.rights import Rights

Name = Annotated[str, Meta(pattern=NAME)]
LONGEST_EXPIRY_MS = 2000.0
"""Nothing that moves or stops a robot waits for longer on its way."""
PORT = 7448
"""Where the desk listens for other machines unless another port is given; zenoh's usual one is
taken on loopback."""


class Address(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Where something listens on this machine."""

    host: str
    port: Port

    @property
    def endpoint(self) -> str:
        """As zenoh writes it."""
        return f"tcp/{self.place}"

    @property
    def place(self) -> str:
        """Host and port."""
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"{host}:{self.port}"

    @property
    def refusal(self) -> str:
        """Why nothing may connect there; empty: it may."""
        return loopback_refusal(self.host)

    @property
    def settings(self) -> dict[str, Any]:
        """What zenoh needs to connect beside the endpoint."""
        return {}


class Credentials(msgspec.Struct, frozen=True):
    """Files, PEM: the site's authority, the own certificate, and its private key."""

    authority: str
    certificate: str
    key: str


class SecureAddress(Address, frozen=True):
    """Where the desk of another machine listens, with what is shown there."""

    credentials: Credentials

    @property
    def endpoint(self) -> str:
        """As zenoh writes it."""
        return f"tls/{self.place}"

    @property
    def refusal(self) -> str:
        """Why nothing may connect there: both sides show certificates, so never."""
        return ""

    @property
    def settings(self) -> dict[str, Any]:
        """What zenoh needs to connect beside the endpoint."""
        return {
            "transport/link/tls/root_ca_certificate": self.credentials.authority,
            "transport/link/tls/connect_certificate": self.credentials.certificate,
            "transport/link/tls/connect_private_key": self.credentials.key,
            "transport/link/tls/enable_mtls": True,
            "transport/link/tls/verify_name_on_connect": True,
            "transport/link/tls/close_link_on_expiration": True,
        }


class Outside(msgspec.Struct, frozen=True):
    """Where the router listens for other machines, what it shows, and what it lets through.

    Attributes:
        address: As the other machines reach it.
        credentials: Of the router.
        access: zenoh's section ``access_control``.
    """

    address: Address
    credentials: Credentials
    access: dict[str, Any]

    @property
    def endpoint(self) -> str:
        """As zenoh writes it."""
        return f"tls/{self.address.place}"

    @property
    def settings(self) -> dict[str, Any]:
        """What zenoh needs to listen beside the endpoint."""
        return {
            "transport/link/tls/root_ca_certificate": self.credentials.authority,
            "transport/link/tls/listen_certificate": self.credentials.certificate,
            "transport/link/tls/listen_private_key": self.credentials.key,
            "transport/link/tls/enable_mtls": True,
            "transport/link/tls/close_link_on_expiration": True,
            "access_control": self.access,
        }


class LinkConfig(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What the link in the cell sends, and what it lets the farm do."""

    state_rate_hz: BusRateHz
    joints_rate_hz: BusRateHz
    health_rate_hz: BusRateHz
    silent_ms: BusSilenceMs
    answer_ms: Annotated[float, Meta(ge=100.0, lt=LONGEST_EXPIRY_MS)]
    events_limit: Annotated[int, Meta(ge=1, le=10_000)]
    remote_at_start: bool
    rights: Rights


class DeskConfig(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The desk: its page, its files, its patience."""

    host: str
    port: Port
    silent_ms: BusSilenceMs
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
        'allowed is only this machine (127.0.0.1): others come in with certificates (--listen)'
    """
    # Of names localhost alone: nobody knows where another one leads.
    if is_this_machine(host):
        return ""
    return "allowed is only this machine (127.0.0.1): others come in with certificates (--listen)"


class ReachedError(ValueError):
    """A text is no HOST[:PORT]; it says so."""


def reached(text: str, port: int = PORT) -> tuple[str, int]:
    """Return host and port of ``HOST[:PORT]``; without a port, ``port``.

    Raises:
        ReachedError: It is no such thing, or an address at which nobody is reached.

    Example:
        >>> reached("hall-pc"), reached("10.0.0.5:8000"), reached("[fd00::1]:8000")
        (('hall-pc', 7448), ('10.0.0.5', 8000), ('fd00::1', 8000))
    """
    host, colon, given = text.rpartition(":")
    # An IPv6 address without a port ends with its bracket: the last colon is inside it.
    if not colon or text.endswith("]"):
        host, given = text, str(port)
    host = host.removeprefix("[").removesuffix("]")
    if not host or not given.isdigit() or not 1 <= int(given) <= 65535:
        raise ReachedError(f"{text}: give HOST or HOST:PORT, [HOST]:PORT for IPv6")
    if host in ("0.0.0.0", "::", "*"):
        raise ReachedError(
            f"{text}: give the name or address at which other machines reach this one"
        )
    return host, int(given)
