"""How the link gets into a gateway that asks for a token or speaks TLS."""

from __future__ import annotations

import contextlib
import select
import ssl
import threading
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any
from urllib.parse import urlsplit

from scara_config import ConfigError
from scara_config.quantities import is_this_machine
from scara_ros.page.token_file_io import (
    TWIN_CONTROLLER_FILE,
    TWIN_CONTROLLER_VARIABLE,
    TokenError,
    read_token,
)
from typing_extensions import Self

from twin_controller.config import Twin


@dataclass(frozen=True, slots=True)
class Access:
    """What a gateway asks of its clients.

    Attributes:
        token: Sent in the handshake's header; None: the gateway asks for no token.
        ca_file: PEM file that proves the certificate of a ``wss://`` gateway; None: the system's
            authorities do.
    """

    token: str | None = field(default=None, repr=False)
    ca_file: str | None = None

    @property
    def headers(self) -> list[str]:
        """Header lines of the handshake."""
        return [f"Authorization: Bearer {self.token}"] if self.token else []


def read_access(twin: Twin, url: str, environment: Mapping[str, str]) -> Access:
    """Return what twin_controller.yaml and the environment give for the gateway at ``url``.

    To a gateway of this machine the twin controller always says who it is, by the token that both
    find: its connection alone may command the twin, and is never kept out. To another machine it
    sends what ``token_environment`` names, else nothing.

    Raises:
        ConfigError: The token's variable is not set or holds no token, the file cannot be used, or
            a secret stands in the file.
    """
    token, where = None, "twin_controller.yaml: twin."
    if "?" in twin.url:
        advice = (
            "must have no query, because the file is published and recorded;"
            " give a token by token_environment"
        )
        raise ConfigError(f"{where}url = {shown(twin.url)}?...: {advice}")
    if twin.token_environment is not None:
        token = environment.get(twin.token_environment)
        if not token:
            raise ConfigError(
                f"{where}token_environment = {twin.token_environment}: the variable is not set: "
                "set it to the gateway's token, or give null"
            )
    elif _is_of_this_machine(url):
        try:
            token = read_token(TWIN_CONTROLLER_VARIABLE, TWIN_CONTROLLER_FILE, environment)
        except TokenError as error:
            raise ConfigError(f"{where}token_environment = null: {error}") from error
    if token is not None and not (token.isascii() and token.isprintable() and " " not in token):
        raise ConfigError(
            f"{where}token_environment = {twin.token_environment or 'null'}: the token must be "
            "printable ASCII without blanks"
        )
    if twin.ca_file is not None:
        what = f"{where}ca_file = {twin.ca_file}:"
        if not is_secure(url):
            raise ConfigError(f"{what} {shown(url)} has no certificate: allowed with wss:// only")
        try:
            tls_context(twin.ca_file)
        except ssl.SSLError as error:
            raise ConfigError(f"{what} is no PEM file with certificates: {error}") from error
        except OSError as error:
            raise ConfigError(f"{what} {error.strerror}") from error
    return Access(token, twin.ca_file)


def shown(url: str) -> str:
    """Return a URL as texts may show it: without user and query, where secrets stand.

    Example:
        >>> shown("wss://cell:9090/?token=secret")
        'wss://cell:9090/'
    """
    scheme, separator, rest = url.partition("#")[0].partition("?")[0].partition("://")
    host, slash, path = rest.partition("/")
    return f"{scheme}{separator}{host.rpartition('@')[2]}{slash}{path}"


def _is_of_this_machine(url: str) -> bool:
    """Return whether a URL names this machine by a loopback address."""
    with contextlib.suppress(ValueError):  # no address but a name, or no URL at all
        return is_this_machine(urlsplit(url).hostname or "")
    return False


def is_secure(url: str) -> bool:
    """Tell whether a URL means TLS."""
    return url.lower().startswith("wss:")


def tls_context(ca_file: str | None) -> ssl.SSLContext:
    """Return the settings of a connection whose server has to prove who it is.

    Raises:
        OSError: The file cannot be used.
    """
    context = ssl.create_default_context(cafile=ca_file)
    context.sslsocket_class = _SharedSocket
    return context


class _SharedSocket(ssl.SSLSocket):
    """A TLS socket that one thread reads while others write.

    OpenSSL itself must not be asked by two at once. The reader waits for data before it takes its
    turn, so that a quiet peer holds up no writer.
    """

    _turn: threading.Lock

    def __new__(cls, *args: Any, **options: Any) -> Self:
        new = super().__new__(cls, *args, **options)
        new._turn = threading.Lock()
        return new

    def recv(self, buflen: int = 1024, flags: int = 0) -> bytes:
        with self._turn:
            waits = self.pending()
        if not waits:
            timeout, poll = self.gettimeout(), select.poll()
            poll.register(self, select.POLLIN)
            if not poll.poll(None if timeout is None else timeout * 1e3):
                raise TimeoutError("timed out")
        with self._turn:
            return super().recv(buflen, flags)

    def send(self, data: Any, flags: int = 0) -> int:
        with self._turn:
            return super().send(data, flags)
