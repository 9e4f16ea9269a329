"""What this machine is in a lab, by the files in its user's folder."""

from __future__ import annotations

import os
from dataclasses import dataclass
from datetime import datetime, timezone

from farm.config import Credentials, load_farm
from farm.lab.address import TLS
from farm.lab.io.line.guard import Admission, LabSecurity, Only, Registered
from farm.lab.io.running import LabError
from farm.security.io.invitation import SecurityError, keys_folder
from farm.security.io.lab_authority import DESK, LabAuthority, has_lab, lab_authority_folder
from farm.security.io.membership import joined, shown_by


@dataclass(frozen=True)
class Identity:
    """What this machine shows.

    Attributes:
        name: In its certificate.
        files: The certificate, its key, and the lab's authority.
    """

    name: str
    files: Credentials

    def security(self, admission: Admission | None = None) -> LabSecurity:
        """Return what dask needs.

        Args:
            admission: Who may be at the other end; None: the desk, and this machine itself.
        """
        return LabSecurity(self.files, admission or Only(frozenset({DESK, self.name})))


def identity(address: str) -> Identity:
    """Return what this machine shows at a scheduler: as the desk, or by its invitation.

    Args:
        address: Of the scheduler. A desk that was invited to another lab is a guest there.

    Raises:
        LabError: It has no certificate of a lab, or that is no good any more.
    """
    keys, now = keys_folder(os.environ), datetime.now(timezone.utc)
    try:
        invitation = joined(keys, lab=True)
        theirs = invitation and f"{TLS}{invitation.host}:{invitation.port}" == address
        if has_lab(keys) and not theirs:
            return Identity(DESK, opened_lab().desk())
        if invitation is not None:
            return Identity(invitation.shown, shown_by(invitation, keys, now))
    except SecurityError as error:
        raise LabError(str(error)) from error
    raise LabError(
        "this machine is in no lab, and its certificate for the farm does not count here: on the "
        "desk ./cell farm invite NAME --lab, then here ./cell farm join NAME.invitation"
    )


def as_scheduler(host: str, port: int) -> LabSecurity:
    """Return what a scheduler needs that is reached as ``host``; makes the authority if needed.

    Raises:
        LabError: Its files cannot be read or written.
    """
    folder = lab_authority_folder(keys_folder(os.environ))
    try:
        authority = opened_lab()
        authority.listened(host, port)
        return Identity(DESK, authority.desk()).security(Registered(folder))
    except SecurityError as error:
        raise LabError(str(error)) from error


def opened_lab() -> LabAuthority:
    """Return this user's lab authority, made if there is none.

    Raises:
        SecurityError: Its files cannot be read or written.
    """
    folder = lab_authority_folder(keys_folder(os.environ))
    return LabAuthority(folder, load_farm().site, datetime.now(timezone.utc))
