"""A real gateway that speaks TLS only and lets nobody in without a token.

Behind it stands no ROS.
"""

from __future__ import annotations

import datetime
import ipaddress
from pathlib import Path
from typing import Any

import msgspec
from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from rosbridge_gateway.config import load_gateway_config
from rosbridge_gateway.connection.server_io import GatewayServer

from harness.workspace import ROOT


class NoGraph:
    """Knows the time, and takes everything else as done."""

    def now(self) -> tuple[int, int]:
        """Return a time."""
        return 12, 34

    def publishing_nodes(self, topic: str) -> list[str]:
        """Return none."""
        return []

    def offering_nodes(self, service: str) -> list[str]:
        """Return none."""
        return []

    def __getattr__(self, name: str) -> Any:
        return lambda *args: None


class SecuredGateway:
    """A running gateway; a context manager.

    Attributes:
        url: Where it is.
        certificate: PEM file by which it can be recognised.
    """

    def __init__(self, folder: Path, tokens: dict[str, str]) -> None:
        """Prepare; ``tokens`` are roles by token."""
        self.certificate, key = write_certificate(folder)
        config = msgspec.structs.replace(
            load_gateway_config(ROOT / "config"),
            port=0,
            tls_certificate=self.certificate,
            tls_key=key,
            loopback_role="",
        )
        self.log: list[str] = []
        self._server = GatewayServer(config, NoGraph(), "/", tokens, self.log.append)
        self.deliver = self._server.deliver
        self.url = f"wss://127.0.0.1:{self._server.port}"

    def __enter__(self) -> SecuredGateway:
        self._server.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._server.stop()


def write_certificate(folder: Path) -> tuple[str, str]:
    """Write a certificate for 127.0.0.1, signed by itself, and its key."""
    key = ec.generate_private_key(ec.SECP256R1())
    name = x509.Name([x509.NameAttribute(x509.NameOID.COMMON_NAME, "127.0.0.1")])
    now = datetime.datetime.now(datetime.timezone.utc)
    builder = (
        x509.CertificateBuilder().subject_name(name).issuer_name(name).public_key(key.public_key())
    )
    builder = (
        builder.serial_number(1)
        .not_valid_before(now)
        .not_valid_after(now + datetime.timedelta(days=1))
    )
    builder = builder.add_extension(
        x509.SubjectAlternativeName([x509.IPAddress(ipaddress.ip_address("127.0.0.1"))]), False
    )
    certificate = folder / "certificate.pem"
    certificate.write_bytes(
        builder.sign(key, hashes.SHA256()).public_bytes(serialization.Encoding.PEM)
    )
    private = folder / "key.pem"
    formats = (
        serialization.Encoding.PEM,
        serialization.PrivateFormat.PKCS8,
        serialization.NoEncryption(),
    )
    private.write_bytes(key.private_bytes(*formats))
    return str(certificate), str(private)
