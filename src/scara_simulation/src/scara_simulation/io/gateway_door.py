"""The gateway's door: its port, its TLS files, and who may come in as what."""

from __future__ import annotations

import hmac
import ipaddress
import socket
import ssl
from collections.abc import Mapping
from urllib.parse import parse_qs, urlsplit

from websockets.http11 import Request

from scara_simulation.gateway_config import GatewayConfig


class GatewayError(RuntimeError):
    """The server cannot start; the text says why and what to do."""


class NotAdmittedError(RuntimeError):
    """A client may not come in; the text says why."""


class Door:
    """Decides a client's role at its handshake."""

    def __init__(self, loopback_role: str, tokens: Mapping[str, str]) -> None:
        """Take the role of local clients without a token (empty: none) and the role by token."""
        self._loopback_role = loopback_role
        self._tokens = dict(tokens)

    def role(self, host: str, request: Request) -> str:
        """Return the role of a client at address ``host``.

        Raises:
            NotAdmittedError: Its token is unknown, or it needs one.
        """
        token = _token(request)
        if token is not None:
            for known, role in self._tokens.items():
                if hmac.compare_digest(known.encode(), token.encode()):
                    return role
            raise NotAdmittedError("unknown token")
        if self._loopback_role and ipaddress.ip_address(host.partition("%")[0]).is_loopback:
            return self._loopback_role
        raise NotAdmittedError("a token is needed")


def bind(config: GatewayConfig) -> socket.socket:
    """Take the port; asyncio listens on it later.

    Raises:
        GatewayError: It is taken or not ours.
    """
    where = f"{config.host}:{config.port}"
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(config.host, config.port, type=socket.SOCK_STREAM)[0]
        line = socket.socket(family, kind, protocol)
    except OSError as error:
        raise GatewayError(f"gateway: address {where} cannot be used: {error}") from error
    try:
        line.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        line.bind(address)
        line.listen()
    except OSError as error:
        line.close()
        raise GatewayError(
            f"gateway: port {where} cannot be opened: {error.strerror}; end the program that has it "
            f"(`ss -ltnp 'sport = :{config.port}'` names it) or choose another by _port:=NUMBER or gateway.yaml"
        ) from error
    line.setblocking(False)
    return line


def tls_context(config: GatewayConfig) -> ssl.SSLContext | None:
    """Read the TLS files of gateway.yaml, or return None when it names none.

    Raises:
        GatewayError: They cannot be read.
    """
    if config.tls_certificate is None or config.tls_key is None:
        return None
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    try:
        context.load_cert_chain(config.tls_certificate, config.tls_key)
    except (OSError, ssl.SSLError) as error:
        raise GatewayError(f"gateway: TLS files {config.tls_certificate}, {config.tls_key}: {error}") from error
    return context


def _token(request: Request) -> str | None:
    """Read the token of a handshake: header first, then query."""
    scheme, _, value = request.headers.get("Authorization", "").partition(" ")
    if scheme.lower() == "bearer":
        return value.strip()
    given = parse_qs(urlsplit(request.path).query).get("token")
    return given[0] if given else None
