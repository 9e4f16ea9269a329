"""The file by which a machine joins: who it is, where the desk is, and what it shows there."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import msgspec
from scara_config.files.whole_file import OWNER_ONLY, write_whole
from scara_config.quantities import Port
from scara_ros.page.token_file_io import token_folder

from farm.config import Name
from farm.security.access import Role

VARIABLE = "FARM_KEYS"
"""Names another folder for keys and certificates, for tests and for two farms of one user."""


class SecurityError(RuntimeError):
    """Keys or certificates cannot be used; the text says why and what to do."""


class Invitation(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What a machine needs to come in.

    Attributes:
        site: First part of all keys.
        name: Who is invited; of a machine, the second part of its cells' keys.
        role: What it may do.
        shown: The name in the certificate. It has a number: each invitation of a name has another.
        host: Where the desk is reached.
        port: Same.
        authority: The site's certificate, PEM.
        certificate: Its own, PEM.
        key: Its private key, PEM.
    """

    site: Name
    name: Name
    role: Role
    shown: str
    host: str
    port: Port
    authority: str
    certificate: str
    key: str


def keys_folder(environment: Mapping[str, str]) -> Path:
    """Return the folder of this user's keys: of the authority, and of what was joined."""
    given = environment.get(VARIABLE)
    return Path(given) if given else token_folder(environment) / "farm"


def read_invitation(file: Path) -> Invitation:
    """Return what stands in an invitation.

    Raises:
        SecurityError: It cannot be read, or is none.
    """
    try:
        return msgspec.json.decode(file.read_bytes(), type=Invitation)
    except OSError as error:
        raise SecurityError(f"{file}: {error.strerror}") from error
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        raise SecurityError(f"{file}: is no invitation to a farm: {error}") from error


def write_private(file: Path, content: bytes) -> None:
    """Write a file whole or not at all, for its owner alone; its folder is made.

    Raises:
        SecurityError: It cannot be written.
    """
    try:
        file.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
        write_whole(file, content, OWNER_ONLY)
    except OSError as error:
        raise SecurityError(f"{file}: {error.strerror}") from error
