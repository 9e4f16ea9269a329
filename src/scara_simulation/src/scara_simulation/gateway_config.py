"""What gateway.yaml may contain."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from msgspec import Meta, Struct
from scara_config import ConfigError, load, locate

Port = Annotated[int, Meta(ge=1, le=65535)]
Seconds = Annotated[float, Meta(gt=0.0, le=3600.0)]
Bytes = Annotated[int, Meta(ge=1024, le=1 << 30)]
Number = Annotated[int, Meta(ge=1, le=1_000_000)]


class Role(Struct, frozen=True, forbid_unknown_fields=True):
    """Patterns of names that a role may use; one without a leading slash stands in the gateway's namespace."""

    token_environment: str
    publish: list[str]
    subscribe: list[str]
    call_service: list[str]
    advertise_service: list[str]


class Limits(Struct, frozen=True, forbid_unknown_fields=True):
    """What one client, and all together, may take."""

    packet_bytes: Bytes
    nesting: Annotated[int, Meta(ge=4, le=200)]
    clients: Number
    topics_per_client: Number
    services_per_client: Number
    packets_per_second: Number
    packets_burst: Number
    calls_per_client: Number
    calls: Annotated[int, Meta(ge=1, le=256)]
    waiting_answers: Number
    send_buffer_bytes: Bytes


class GatewayConfig(Struct, frozen=True, forbid_unknown_fields=True):
    """The gateway of gateway.yaml."""

    host: str
    port: Port
    tls_certificate: str | None
    tls_key: str | None
    origins: list[str]
    loopback_role: str
    roles: dict[str, Role]
    ping_interval: Seconds
    ping_timeout: Seconds
    stall_timeout: Seconds
    close_timeout: Seconds
    service_timeout: Seconds
    service_timeout_max: Seconds
    limits: Limits


def load_gateway_config(directory: Path | str | None = None) -> GatewayConfig:
    """Read gateway.yaml of ``directory`` (default: the package scara_config).

    Raises:
        ConfigError: The file is missing or wrong, a role is unknown, or TLS has only one of its two files.
    """
    path = locate("gateway.yaml", directory)
    config = load(path, GatewayConfig)
    if config.loopback_role and config.loopback_role not in config.roles:
        raise ConfigError(
            f"{path}: loopback_role = {config.loopback_role!r}: allowed: {', '.join(config.roles)}, or empty for none"
        )
    if (config.tls_certificate is None) != (config.tls_key is None):
        raise ConfigError(f"{path}: tls_certificate and tls_key: give both files, or null for both")
    if config.service_timeout > config.service_timeout_max:
        raise ConfigError(
            f"{path}: service_timeout = {config.service_timeout}: allowed: at most service_timeout_max "
            f"= {config.service_timeout_max}"
        )
    return config
