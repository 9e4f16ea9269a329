"""The lab's authority: whom it invites runs programs on all machines of the lab.

It has a key of its own, in a folder of its own: a certificate of the farm is none of the lab, and
one of the lab opens no line of the farm. The machine that has it is the lab's desk.
"""

from __future__ import annotations

from pathlib import Path

from farm.config import Credentials
from farm.security.access import Role
from farm.security.authority_io import CERTIFICATE, KEY, SiteAuthority
from farm.security.certificates import CertificateError, KeyPair, new_member
from farm.security.invitation_io import SecurityError, write_private

OWN = "desk.pem"
"""Certificate and key in one file, so that both are always of one another."""


class LabAuthority(SiteAuthority):
    """The authority of a site's lab, made when it is needed first."""

    purpose = "lab"
    roles = (Role.LAB,)
    started_by = "./cell lab scheduler --listen HOST"

    def desk(self) -> Credentials:
        """Return what this machine shows in the lab, made anew each time.

        Raises:
            SecurityError: It cannot be made or kept.
        """
        file = self._folder / OWN
        try:
            made = self._issued("lab desk")
        except CertificateError as error:
            raise SecurityError(f"{self._folder}: {error}") from error
        write_private(file, made.key + made.certificate)
        return Credentials(str(self._folder / CERTIFICATE), str(file), str(file))

    def _issued(self, shown: str) -> KeyPair:
        # For invitations too: a worker is asked by the scheduler, so it shows this as a server.
        return new_member(self._pair, shown, self._now)


def lab_authority_folder(keys: Path) -> Path:
    """Return where the lab's authority is, in the folder of a user's keys."""
    return keys / "lab"


def has_lab(keys: Path) -> bool:
    """Return whether this machine is a lab's desk."""
    return (lab_authority_folder(keys) / KEY).exists()
