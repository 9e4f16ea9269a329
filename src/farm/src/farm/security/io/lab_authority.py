"""The lab's authority: whom it invites runs programs on all machines of the lab.

It has a key of its own, in a folder of its own: a certificate of the farm is none of the lab, and
one of the lab opens no line of the farm. The machine that has it is the lab's desk, and shows
:data:`DESK`; workers obey nobody else.
"""

from __future__ import annotations

from pathlib import Path

from msgspec.structs import replace

from farm.config import Credentials
from farm.security.access import Role
from farm.security.certificates import (
    CertificateError,
    Pair,
    check,
    ends,
    new_member,
)
from farm.security.io.authority import CERTIFICATE, KEY, SOON, Authority
from farm.security.io.invitation import SecurityError, write_private

DESK = "lab desk"
"""Name in the desk's certificate. An invited one ends with a number, so none is the same."""
OWN = "desk.pem"
"""Certificate and key in one file, so that both are always of one another."""


class LabAuthority(Authority):
    """The authority of a site's lab, made when it is needed first."""

    purpose = "lab"
    roles = (Role.LAB,)
    started_by = "./cell lab scheduler --listen HOST"

    def listened(self, host: str, port: int) -> None:
        """Remember where the scheduler is reached, for invitations.

        Raises:
            SecurityError: It cannot be kept.
        """
        self._write(replace(self.register, listened=(host, port)))

    def desk(self) -> Credentials:
        """Return what this machine shows in the lab; made anew before it ends.

        Raises:
            SecurityError: It cannot be made or kept.
        """
        file = self._folder / OWN
        if not self._good(file):
            try:
                made = self._issued(DESK)
            except CertificateError as error:
                raise SecurityError(f"{self._folder}: {error}") from error
            write_private(file, made.key + made.certificate)
        return Credentials(str(self._folder / CERTIFICATE), str(file), str(file))

    def _issued(self, shown: str) -> Pair:
        return new_member(self._pair, shown, self._now)

    def _good(self, file: Path) -> bool:
        if not file.exists():
            return False
        try:
            text = file.read_bytes()
            check(self._pair.certificate, Pair(text, text), DESK, self._now)
            return ends(text) > self._now + SOON
        except OSError as error:
            raise SecurityError(f"{file}: {error.strerror}") from error
        except CertificateError:
            return False  # of an authority before this one, or ended


def lab_authority_folder(keys: Path) -> Path:
    """Return where the lab's authority is, in the folder of a user's keys."""
    return keys / "lab"


def has_lab(keys: Path) -> bool:
    """Return whether this machine is a lab's desk."""
    return (lab_authority_folder(keys) / KEY).exists()
