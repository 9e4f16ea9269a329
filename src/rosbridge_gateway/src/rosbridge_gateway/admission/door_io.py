"""The gateway's door: its port, its TLS files, and who may come in as what."""

from __future__ import annotations

import ipaddress
import socket
import ssl
from collections.abc import Mapping
from http import HTTPStatus
from urllib.parse import parse_qs, urlsplit

from websockets.datastructures import Headers

from rosbridge_gateway.admission.origin import is_allowed, is_file, own_origins
from rosbridge_gateway.admission.places import Visitor
from rosbridge_gateway.admission.tokens import Guesses, Tokens
from rosbridge_gateway.config import GatewayConfig, origin_patterns

_SHOWN = 100  # our choice: longest part of an origin that is repeated


class GatewayError(RuntimeError):
    """The server cannot start; the text says why and what to do."""


class NotAdmittedError(RuntimeError):
    """A client may not come in; the text says why, ``status`` is the answer to its handshake."""

    def __init__(self, status: HTTPStatus, reason: str, retry_after: float = 0.0) -> None:
        super().__init__(reason)
        self.status = status
        self.retry_after = retry_after
        """After so long [s] it may try again; 0 if it need not try."""


class Door:
    """Decides at a handshake who a client is."""

    def __init__(
        self,
        config: GatewayConfig,
        tokens: Mapping[str, str],
        persons: Mapping[str, str] | None = None,
    ) -> None:
        """Take roles and origins of gateway.yaml, the role by token, and the person by token."""
        self._persons = dict(persons or {})
        self._loopback_role, self._page_role = config.loopback_role, config.page_role
        self._origins = origin_patterns(config)
        self._own_origins = own_origins(config.port, is_tls=config.tls_certificate is not None)
        self._tokens = Tokens(tokens)
        self._guesses = Guesses(config.guesses)

    def admit(self, host: str, headers: Headers, path: str, now: float) -> Visitor:
        """Return who comes.

        Args:
            host: Address of the client.
            headers: Of its handshake.
            path: Of its handshake, with the query.
            now: Monotonic [s].

        Raises:
            NotAdmittedError: It is a web page that may not connect, its token is unknown, it needs
                one, or it has brought too many wrong ones.
        """
        origins = headers.get_all("Origin")
        # There is no page at the gateway's own address: a program names it so (websocket-client).
        if len(origins) == 1 and is_allowed(origins[0], self._own_origins):
            origins = []
        if any(not is_allowed(origin, self._origins) for origin in origins):
            raise NotAdmittedError(HTTPStatus.FORBIDDEN, _unknown_page(origins[0]))
        token = _token(headers, path)
        if token is not None:
            role = self._role_by(token, host, now)
            if any(is_file(origin) for origin in origins):
                # It reads only, whatever token it has brought: any web site can make a frame with
                # the same origin, and ask its visitor for a token.
                if not self._page_role:
                    why = "pages need a page_role in gateway.yaml"
                    raise NotAdmittedError(HTTPStatus.FORBIDDEN, why)
                return Visitor(self._page_role, is_page=True)
            person = self._persons.get(token, "")
            return Visitor(role, False, person, token if person else "")
        # Whatever page a browser shows: its user may have opened it without knowing what it does.
        role = self._page_role if origins else self._loopback_role
        if role and ipaddress.ip_address(host.partition("%")[0]).is_loopback:
            return Visitor(role, is_page=bool(origins))
        raise NotAdmittedError(HTTPStatus.UNAUTHORIZED, "a token is needed")

    def _role_by(self, token: str, host: str, now: float) -> str:
        wait = self._guesses.wait(host, now)
        role = self._tokens.role(token, only_unguessable=wait > 0.0)
        if role is not None:
            return role
        if wait > 0.0:
            # The same words each time, so that who tries again and again is told of it once.
            reason = "wrong tokens came from this address: wait before the next"
            raise NotAdmittedError(HTTPStatus.TOO_MANY_REQUESTS, reason, wait)
        wait = self._guesses.wrong(host, now)
        raise NotAdmittedError(HTTPStatus.UNAUTHORIZED, "unknown token", wait)


def bind(config: GatewayConfig) -> socket.socket:
    """Take the port; asyncio listens on it later.

    Raises:
        GatewayError: It is taken or not ours.
    """
    where = f"{config.host}:{config.port}"
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(
            config.host, config.port, type=socket.SOCK_STREAM
        )[0]
        line = socket.socket(family, kind, protocol)
    except OSError as error:
        raise GatewayError(f"address {where} cannot be used: {error}") from error
    try:
        line.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        line.bind(address)
        line.listen()
    except OSError as error:
        line.close()
        raise GatewayError(
            f"port {where} cannot be opened: {error.strerror}; end the program that has "
            f"it (`ss -ltnp 'sport = :{config.port}'` names it) or choose another by _port:=NUMBER "
            "or gateway.yaml"
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
        raise GatewayError(
            f"TLS files {config.tls_certificate}, {config.tls_key}: {error}"
        ) from error
    return context


def _unknown_page(origin: str) -> str:
    if origin == "null":
        return (
            "a page of 'null' may not connect: a frame of any web site can say that; open the page "
            "from a server whose address stands in origins of gateway.yaml"
        )
    return f"a page of {origin[:_SHOWN]!r} may not connect"


def _token(headers: Headers, path: str) -> str | None:
    """Read the token of a handshake: header first, then query."""
    for line in headers.get_all("Authorization"):
        scheme, _, value = line.partition(" ")
        if scheme.lower() == "bearer":
            return value.strip()
    given = parse_qs(urlsplit(path).query).get("token")
    return given[0] if given else None
