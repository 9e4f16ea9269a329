"""What this machine has joined: the files of its invitation, and what they make of farm.yaml."""

from __future__ import annotations

import shutil
from datetime import datetime
from pathlib import Path

import msgspec
from msgspec.structs import replace

from farm.config import Credentials, FarmConfig, SecureAddress
from farm.security.access import Role
from farm.security.certificates import CertificateError, KeyPair, check
from farm.security.invitation_io import Invitation, SecurityError, read_invitation, write_private

TOLD, AUTHORITY, CERTIFICATE, KEY = "joined.json", "authority.crt", "own.crt", "own.key"


def member_folder(keys: Path, *, lab: bool = False) -> Path:
    """Return where the invitation is kept, in the folder of a user's keys.

    Args:
        keys: That folder.
        lab: Of the invitation to a lab; else to a farm. One does not replace the other.
    """
    return keys / ("lab_member" if lab else "member")


def join(keys: Path, file: Path, now: datetime) -> Invitation:
    """Keep an invitation, in the place of the one before.

    Raises:
        SecurityError: It is none, its certificate is no good, or it cannot be kept.
    """
    invitation = read_invitation(file)
    _check(invitation, str(file), now)
    folder = member_folder(keys, lab=invitation.role is Role.LAB)
    for name, text in (
        (AUTHORITY, invitation.authority),
        (CERTIFICATE, invitation.certificate),
        (KEY, invitation.key),
    ):
        write_private(folder / name, text.encode())
    # Last: without it nothing was joined.
    write_private(folder / TOLD, msgspec.json.encode(invitation))
    return invitation


def leave(keys: Path, *, lab: bool = False) -> bool:
    """Forget what was joined; return whether there was something.

    Raises:
        SecurityError: It cannot be removed.
    """
    folder = member_folder(keys, lab=lab)
    if not folder.exists():
        return False
    try:
        shutil.rmtree(folder)
    except OSError as error:
        raise SecurityError(f"{folder}: {error.strerror}") from error
    return True


def joined(keys: Path, *, lab: bool = False) -> Invitation | None:
    """Return what this machine has joined; None: nothing.

    Raises:
        SecurityError: It cannot be read.
    """
    file = member_folder(keys, lab=lab) / TOLD
    return read_invitation(file) if file.exists() else None


def as_member(config: FarmConfig, keys: Path, now: datetime) -> FarmConfig:
    """Return farm.yaml as it is on a machine that has joined: its site, name and desk.

    Raises:
        SecurityError: What was joined is no good any more.
    """
    invitation = joined(keys)
    if invitation is None:
        return config
    files = shown_by(invitation, keys, now)
    return replace(
        config,
        site=invitation.site,
        machine=invitation.name if invitation.role is Role.MACHINE else config.machine,
        router=SecureAddress(invitation.host, invitation.port, files),
    )


def shown_by(invitation: Invitation, keys: Path, now: datetime) -> Credentials:
    """Return the files of what was joined.

    Raises:
        SecurityError: It is no good any more.
    """
    folder = member_folder(keys, lab=invitation.role is Role.LAB)
    files = [folder / name for name in (AUTHORITY, CERTIFICATE, KEY)]
    try:
        authority, certificate, key = (file.read_text() for file in files)
    except OSError as error:
        raise SecurityError(f"{error.filename}: {error.strerror}") from error
    # What the files hold now, for these are shown; they may have changed since.
    there = replace(invitation, authority=authority, certificate=certificate, key=key)
    _check(there, str(folder / CERTIFICATE), now)
    return Credentials(*map(str, files))


def _check(invitation: Invitation, place: str, now: datetime) -> None:
    pair = KeyPair(invitation.key.encode(), invitation.certificate.encode())
    try:
        check(invitation.authority.encode(), pair, invitation.shown, now)
    except CertificateError as error:
        raise SecurityError(f"{place}: {error}") from error
