"""What gateway.yaml may contain."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from msgspec import Meta, Struct
from scara_config import ConfigError, load, locate

from rosbridge_gateway.admission.origin import Origin, OriginError

Port = Annotated[int, Meta(ge=1, le=65535)]
Seconds = Annotated[float, Meta(gt=0.0, le=3600.0)]
Bytes = Annotated[int, Meta(ge=1024, le=1 << 30)]
Percent = Annotated[float, Meta(gt=0.0, le=100.0)]
Number = Annotated[int, Meta(ge=1, le=1_000_000)]


class Takes(Struct, frozen=True, forbid_unknown_fields=True):
    """What one connection of a role may take of the gateway.

    A longer packet is refused. Who takes more a second waits: its next bytes are read later.
    ``cpu_percent_together`` is of one core, for all connections of the role; ``calls``: running
    service calls of one connection; ``shortest_fragment``: bytes of the pieces that it gets.
    """

    packet_bytes: Bytes
    packets_per_second: Number
    bytes_per_second: Bytes
    cpu_percent: Percent
    cpu_percent_together: Percent
    calls: Annotated[int, Meta(ge=1, le=256)]
    shortest_fragment: Number


class Role(Struct, frozen=True, forbid_unknown_fields=True):
    """Patterns of names that a role may use, and what its connections may take.

    One without a leading slash stands in the gateway's namespace. ``token_file``: see
    :func:`scara_ros.io.token_file.read_token`. ``places``: connections of this role for which there
    is always a place; 0: it shares ``limits.clients`` with the others.
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
    ping_interval: Seconds
    ping_timeout: Seconds


class FirstMessages(Struct, frozen=True, forbid_unknown_fields=True):
    """What a client publishes before its subscribers are there.

    Messages of the first ``seconds`` after an advertise are kept for subscribers that connect, each
    for ``seconds`` and at most ``count`` of a topic; never those of ``never_topics`` and
    ``never_types``. A stop forgets those of ``until_stop_topics`` and ``until_stop_types``.
    """

    seconds: Annotated[float, Meta(gt=0.0, le=10.0)]
    count: Number
    never_topics: list[str]
    never_types: list[str]
    until_stop_topics: list[str]
    until_stop_types: list[str]


class Stops(Struct, frozen=True, forbid_unknown_fields=True):
    """Which packets stop a robot: they wait for nothing that the same client has sent before.

    By topic or service, the values of the field ``command`` that do.
    """

    publish: dict[str, list[int]]
    call_service: dict[str, list[str]]


class GuessLimits(Struct, frozen=True, forbid_unknown_fields=True):
    """How wrong tokens slow an address down; each delay is twice the one before."""

    first_delay: Seconds
    longest_delay: Seconds
    forgotten_after: Seconds
    addresses: Number


class Limits(Struct, frozen=True, forbid_unknown_fields=True):
    """What one client, and all together, may take; see :class:`Takes` for what the role decides.

    ``burst``: so much time's worth [s] of a budget may be taken at once. ``calls``: running service
    calls of all clients; ``page_calls``: of these, those of web pages without a token.
    """

    nesting: Annotated[int, Meta(ge=4, le=200)]
    clients: Number
    topics_per_client: Number
    services_per_client: Number
    burst: Seconds
    calls: Annotated[int, Meta(ge=1, le=256)]
    page_calls: Annotated[int, Meta(ge=1, le=256)]
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
    page_role: str
    roles: dict[str, Role]
    reserved: Reserved
    person_services: list[str]
    guesses: GuessLimits
    ping_interval: Seconds
    ping_timeout: Seconds
    driving: Driving
    first_messages: FirstMessages
    stops: Stops
    begin_timeout: Seconds
    unstamped_age: Seconds
    sender_stamps: list[str]
    handshake_timeout: Seconds
    stall_timeout: Seconds
    close_timeout: Seconds
    service_timeout: Seconds
    service_timeout_max: Seconds
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
