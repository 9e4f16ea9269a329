"""Keys and certificates: elliptic curve P-256, X.509, by the library cryptography.

The site has an authority of its own, which no browser and no system trusts. Source: RFC 5280.
"""

from __future__ import annotations

import ipaddress
from collections.abc import Iterable
from datetime import datetime, timedelta
from typing import NamedTuple

from cryptography import x509
from cryptography.exceptions import InvalidSignature
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

DAYS = 90
"""How long a certificate is good. Our choice: a machine that is forgotten is out by itself."""
AUTHORITY_DAYS = 3650
EARLY = timedelta(hours=1)
"""Certificates begin so much earlier: clocks of machines differ. Our choice."""


class CertificateError(ValueError):
    """A key or certificate cannot be used; the text says why."""


class KeyPair(NamedTuple):
    """A private key and its certificate, both as PEM."""

    key: bytes
    certificate: bytes


def new_authority(name_of: str, now: datetime) -> KeyPair:
    """Return an authority of this name that signs itself."""
    key, name = _new_key(), _name(name_of)
    builder = (
        _builder(name, name, key.public_key(), now, AUTHORITY_DAYS)
        .add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
        .add_extension(_usage(signs_certificates=True), critical=True)
    )
    return _pair(key, builder.sign(key, hashes.SHA256()))


def new_server(authority: KeyPair, host: str, now: datetime) -> KeyPair:
    """Return what a router shows that is reached as ``host``, a name or an address."""
    place: x509.GeneralName
    try:
        place = x509.IPAddress(ipaddress.ip_address(host))
    except ValueError:
        place = x509.DNSName(host)
    return _issued(authority, host, place, (ExtendedKeyUsageOID.SERVER_AUTH,), now)


def new_client(authority: KeyPair, name: str, now: datetime) -> KeyPair:
    """Return what somebody shows who comes in."""
    return _issued(authority, name, x509.DNSName(name), (ExtendedKeyUsageOID.CLIENT_AUTH,), now)


def new_member(authority: KeyPair, name: str, now: datetime) -> KeyPair:
    """Return what a member of the lab shows at both ends of a line."""
    both = (ExtendedKeyUsageOID.SERVER_AUTH, ExtendedKeyUsageOID.CLIENT_AUTH)
    return _issued(authority, name, x509.DNSName(name), both, now)


def ends(certificate: bytes) -> datetime:
    """Return until when a certificate is good (UTC).

    Raises:
        CertificateError: It is none.
    """
    return _read(certificate).not_valid_after_utc


def check(authority: bytes, client: KeyPair, name: str, now: datetime) -> None:
    """Check what somebody is to show.

    Raises:
        CertificateError: It cannot be read, is of another authority or another name, does not fit
            its key, or its time is over or has not come.
    """
    certificate = _read(client.certificate)
    try:
        certificate.verify_directly_issued_by(_read(authority))
    except (InvalidSignature, ValueError, TypeError) as error:
        raise CertificateError("the certificate is not of the authority beside it") from error
    named = [str(a.value) for a in certificate.subject.get_attributes_for_oid(NameOID.COMMON_NAME)]
    if named != [name]:
        raise CertificateError(f"the certificate is of {', '.join(named)}, not of {name}")
    try:
        key = serialization.load_pem_private_key(client.key, None)
    except (ValueError, TypeError) as error:
        raise CertificateError(f"the private key cannot be read: {error}") from error
    if key.public_key() != certificate.public_key():
        raise CertificateError("the private key is not that of the certificate")
    begin, end = certificate.not_valid_before_utc, certificate.not_valid_after_utc
    if not begin <= now <= end:
        raise CertificateError(
            f"the certificate is good from {begin:%Y-%m-%d} to {end:%Y-%m-%d}: ask for another "
            "invitation, and look at this machine's clock"
        )


def _issued(
    authority: KeyPair,
    name: str,
    place: x509.GeneralName,
    uses: Iterable[x509.ObjectIdentifier],
    now: datetime,
) -> KeyPair:
    signer = serialization.load_pem_private_key(authority.key, None)
    if not isinstance(signer, ec.EllipticCurvePrivateKey):
        raise CertificateError("the authority's key is not one of an elliptic curve")
    key = _new_key()
    issuer = _read(authority.certificate).subject
    builder = (
        _builder(_name(name), issuer, key.public_key(), now, DAYS)
        .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        .add_extension(_usage(signs_certificates=False), critical=True)
        # TLS looks for the host in here only; the subject's name is what the router's rules go by.
        .add_extension(x509.SubjectAlternativeName([place]), critical=False)
        .add_extension(x509.ExtendedKeyUsage(uses), critical=False)
    )
    return _pair(key, builder.sign(signer, hashes.SHA256()))


def _builder(
    subject: x509.Name,
    issuer: x509.Name,
    key: ec.EllipticCurvePublicKey,
    now: datetime,
    days: int,
) -> x509.CertificateBuilder:
    return (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(issuer)
        .public_key(key)
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - EARLY)
        .not_valid_after(now + timedelta(days=days))
    )


def _usage(*, signs_certificates: bool) -> x509.KeyUsage:
    return x509.KeyUsage(
        digital_signature=not signs_certificates,
        content_commitment=False,
        key_encipherment=False,
        data_encipherment=False,
        key_agreement=False,
        key_cert_sign=signs_certificates,
        crl_sign=False,
        encipher_only=False,
        decipher_only=False,
    )


def _new_key() -> ec.EllipticCurvePrivateKey:
    return ec.generate_private_key(ec.SECP256R1())


def _name(text: str) -> x509.Name:
    return x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, text)])


def _read(certificate: bytes) -> x509.Certificate:
    try:
        return x509.load_pem_x509_certificate(certificate)
    except ValueError as error:
        raise CertificateError(f"the certificate cannot be read: {error}") from error


def _pair(key: ec.EllipticCurvePrivateKey, certificate: x509.Certificate) -> KeyPair:
    private = key.private_bytes(
        serialization.Encoding.PEM,
        serialization.PrivateFormat.PKCS8,
        serialization.NoEncryption(),
    )
    return KeyPair(private, certificate.public_bytes(serialization.Encoding.PEM))
