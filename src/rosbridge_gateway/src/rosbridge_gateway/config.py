"""What gateway.yaml may contain."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from msgspec import Meta, Struct
from scara_config import ConfigError, load, locate
from scara_config.quantities import (
    GraceSeconds,
    PartPercent,
    Port,
    SignSeconds,
    ThingsHeld,
    WaitSeconds,
)

from rosbridge_gateway.admission.origin import Origin, OriginError


class Takes(Struct, frozen=True, forbid_unknown_fields=True):
    """What one connection of a role may take of the gateway.

    A longer packet is refused. Who takes more a second waits: its next bytes are read later.
    ``cpu_percent_together`` is of one core, for all connections of the role; ``calls``: running
    service calls of one connection; ``shortest_fragment``: bytes of the pieces that it gets.
    """

    packet_bytes: Annotated[int, Meta(ge=4096, le=1 << 23)]
    packets_per_second: Annotated[int, Meta(ge=10, le=100_000)]
    bytes_per_second: Annotated[int, Meta(ge=1 << 14, le=1 << 27)]
    cpu_percent: PartPercent
    cpu_percent_together: PartPercent
    calls: Annotated[int, Meta(ge=1, le=256)]
    shortest_fragment: Annotated[int, Meta(ge=1, le=1 << 16)]


class RoleRules(Struct, frozen=True, forbid_unknown_fields=True):
    """Patterns of names that a role may use, and what its connections may take.

    One without a leading slash stands in the gateway's namespace. ``token_file``: see
    :func:`scara_ros.page.token_file_io.read_token`. ``places``: connections of this role for which
    there is always a place; 0: it shares ``limits.clients`` with the others.
    """

    token_environment: str
    token_file: str | None
    places: Annotated[int, Meta(ge=0, le=100)]
    takes: Takes
    publish: list[str]
    subscribe: list[str]
    call_service: list[str]
    advertise_service: list[str]


class Reserved(Struct, frozen=True, forbid_unknown_fields=True):
    """Patterns of names that belong to the cell's own nodes, whatever a role may use.

    ``shared``: topics that several may publish, though they fit ``publish`` or have a publisher.
    """

    publish: list[str]
    shared: list[str]
    advertise_service: list[str]


class Driving(Struct, frozen=True, forbid_unknown_fields=True):
    """Which connections move the robot: those of ``roles``, and those that publish ``topics``.

    They are asked for a sign of life more often than others.
    """

    roles: list[str]
    topics: list[str]
    ping_interval: SignSeconds
    ping_timeout: SignSeconds


class FirstMessages(Struct, frozen=True, forbid_unknown_fields=True):
    """What a client publishes before its subscribers are there.

    Messages of the first ``seconds`` after an advertise are kept for subscribers that connect, each
    for ``seconds`` and at most ``count`` of a topic; never those of ``never_topics`` and
    ``never_types``. A stop forgets those of ``until_stop_topics`` and ``until_stop_types``.
    """

    seconds: Annotated[float, Meta(ge=0.05, le=10.0)]
    count: ThingsHeld
    never_topics: list[str]
    never_types: list[str]
    until_stop_topics: list[str]
    until_stop_types: list[str]


class Stops(Struct, frozen=True, forbid_unknown_fields=True):
    """Which packets stop a robot: they wait for nothing that the same client has sent before.

    By topic or service, the values of the field ``command`` that do; none: whatever is sent there.
    """

    publish: dict[str, list[Annotated[int, Meta(ge=1, le=255)]]]
    call_service: dict[str, list[str]]


class GuessLimits(Struct, frozen=True, forbid_unknown_fields=True):
    """How wrong tokens slow an address down; each delay is twice the one before."""

    first_delay: Annotated[float, Meta(ge=0.05, le=60.0)]
    longest_delay: GraceSeconds
    forgotten_after: WaitSeconds
    addresses: Annotated[int, Meta(ge=16, le=100_000)]


class Limits(Struct, frozen=True, forbid_unknown_fields=True):
    """What one client, and all together, may take; see :class:`Takes` for what the role decides.

    ``burst``: so much time's worth [s] of a budget may be taken at once. ``calls``: running service
    calls of all clients; ``page_calls``: of these, those of web pages without a token.
    """

    nesting: Annotated[int, Meta(ge=4, le=200)]
    clients: ThingsHeld
    topics_per_client: ThingsHeld
    services_per_client: ThingsHeld
    burst: Annotated[float, Meta(ge=0.05, le=5.0)]
    calls: Annotated[int, Meta(ge=1, le=256)]
    page_calls: Annotated[int, Meta(ge=1, le=256)]
    waiting_answers: Annotated[int, Meta(ge=10, le=100_000)]
    waiting_bytes: Annotated[int, Meta(ge=1 << 16, le=1 << 28)]
    send_buffer_bytes: Annotated[int, Meta(ge=4096, le=1 << 24)]


class GatewayConfig(Struct, frozen=True, forbid_unknown_fields=True):
    """The gateway of gateway.yaml."""

    host: str
    port: Port
    tls_certificate: str | None
    tls_key: str | None
    origins: list[str]
    loopback_role: str
    page_role: str
    roles: dict[str, RoleRules]
    reserved: Reserved
    person_services: list[str]
    guesses: GuessLimits
    ping_interval: GraceSeconds
    ping_timeout: GraceSeconds
    driving: Driving
    first_messages: FirstMessages
    stops: Stops
    begin_timeout: Annotated[float, Meta(ge=0.01, le=1.0)]
    unstamped_age: Annotated[float, Meta(ge=0.005, le=0.2)]
    sender_stamps: list[str]
    handshake_timeout: GraceSeconds
    stall_timeout: GraceSeconds
    close_timeout: GraceSeconds
    service_timeout: WaitSeconds
    service_timeout_max: WaitSeconds
    limits: Limits


def load_gateway_config(directory: Path | str | None = None) -> GatewayConfig:
    """Read gateway.yaml of ``directory`` (default: the package scara_config).

    Raises:
        ConfigError: The file is missing or wrong, a role is unknown, an origin is no pattern, or
            TLS has only one of its two files.
    """
    path = locate("gateway.yaml", directory)
    config = load(path, GatewayConfig)
    for key in ("loopback_role", "page_role"):
        role = getattr(config, key)
        if role and role not in config.roles:
            allowed = ", ".join(config.roles)
            raise ConfigError(f"{path}: {key} = {role!r}: allowed: {allowed}, or empty for none")
    for role in config.driving.roles:
        if role not in config.roles:
            raise ConfigError(
                f"{path}: driving.roles: {role!r}: allowed: {', '.join(config.roles)}"
            )
    try:
        origin_patterns(config)
    except OriginError as error:
        raise ConfigError(f"{path}: origins: {error}") from error
    guesses = config.guesses
    if not guesses.first_delay <= guesses.longest_delay < guesses.forgotten_after:
        raise ConfigError(
            f"{path}: guesses: allowed: first_delay = {guesses.first_delay} <= longest_delay = "
            f"{guesses.longest_delay} < forgotten_after = {guesses.forgotten_after}"
        )
    if (config.tls_certificate is None) != (config.tls_key is None):
        raise ConfigError(f"{path}: tls_certificate and tls_key: give both files, or null for both")
    if config.service_timeout > config.service_timeout_max:
        raise ConfigError(
            f"{path}: service_timeout = {config.service_timeout}: allowed: at most "
            "service_timeout_max "
            f"= {config.service_timeout_max}"
        )
    return config


def origin_patterns(config: GatewayConfig) -> tuple[Origin, ...]:
    """Return the web pages that may connect.

    Raises:
        OriginError: One is no pattern.
    """
    return tuple(Origin.pattern(text) for text in config.origins)
