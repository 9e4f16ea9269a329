"""The site's authority: it invites machines, remembers whom, and makes the router's certificate.

Its folder holds ``authority.key`` and ``authority.crt``, ``server.key`` and ``server.crt`` of the
router, and ``invited.json``. Whoever has the key can let himself in: it never leaves the folder.
"""

from __future__ import annotations

import contextlib
import fcntl
import os
from collections.abc import Callable, Iterator
from datetime import datetime, timedelta
from pathlib import Path

import msgspec

from farm.config import Address, Credentials, Outside
from farm.security.access import Invited, Role, access_control
from farm.security.certificates import (
    DAYS,
    CertificateError,
    KeyPair,
    new_authority,
    new_client,
    new_server,
)
from farm.security.invitation_io import Invitation, SecurityError, write_private

KEY, CERTIFICATE, REGISTER = "authority.key", "authority.crt", "invited.json"
SERVER_KEY, SERVER_CERTIFICATE = "server.key", "server.crt"
LOCK = "lock"
SOON = timedelta(days=14)
"""A certificate that ends so soon is told of. Our choice."""


class MemberRegister(msgspec.Struct, frozen=True):
    """Everybody who was invited, and where the desk was reached last (HOST, PORT)."""

    invited: tuple[Invited, ...] = ()
    listened: tuple[str, int] | None = None


class SiteAuthority:
    """The authority of a site's farm, made when it is needed first."""

    purpose = "farm"
    """What it lets in to."""
    roles: tuple[Role, ...] = (Role.MACHINE, Role.DESK)
    """Of those whom it invites."""
    started_by = "./cell farm --listen HOST"

    def __init__(self, folder: Path, site: str, now: datetime) -> None:
        """Read it, or make it.

        Raises:
            SecurityError: Its files cannot be read or written, or others can read its key.
        """
        self._folder, self._site, self._now = folder, site, now
        if self._is_new():
            with self._alone():
                if self._is_new():
                    made = new_authority(f"{site} {self.purpose}", now)
                    write_private(folder / KEY, made.key)
                    write_private(folder / CERTIFICATE, made.certificate)
        self._read()

    def _is_new(self) -> bool:
        # One without the other is a loss that somebody has to look at, and no new site.
        return not (self._folder / KEY).exists() and not (self._folder / CERTIFICATE).exists()

    @contextlib.contextmanager
    def _alone(self) -> Iterator[None]:
        """Let nobody else change the files meanwhile: a desk and a command line may at once."""
        try:
            self._folder.mkdir(parents=True, exist_ok=True, mode=0o700)
            lock = (self._folder / LOCK).open("a")
            fcntl.flock(lock, fcntl.LOCK_EX)
        except OSError as error:
            raise SecurityError(f"{self._folder / LOCK}: {error.strerror}") from error
        with lock:
            yield

    def _read(self) -> None:
        """Take in what the files say now."""
        key, certificate = self._folder / KEY, self._folder / CERTIFICATE
        try:
            if key.stat().st_mode & 0o077:
                raise SecurityError(f"{key}: others can read it: chmod 600, or begin a new site")
            self._pair = KeyPair(key.read_bytes(), certificate.read_bytes())
        except OSError as error:
            raise SecurityError(f"{error.filename}: {error.strerror}") from error
        self.register = read_register(self._folder)

    def invite(self, name: str, role: Role, reached: tuple[str, int] | None) -> Invitation:
        """Make a certificate for somebody; what he had before is good no more.

        Args:
            name: Who.
            role: What it is.
            reached: Where it finds the desk, host and port; None: where the desk listened last.

        Raises:
            SecurityError: The register cannot be written, nobody knows where the desk is, or it is
                not this authority that gives this role.
        """
        if role not in self.roles:
            raise SecurityError(f"{role.value}: the authority of the {self.purpose} gives no such")
        with self._alone():
            self._read()
            place = self._reached(reached)
            before = next((each for each in self.register.invited if each.name == name), None)
            entry = self._next(name, role, before)
            made = self._invitation(entry, place)
            others = [each for each in self.register.invited if each.name != name]
            self._write(msgspec.structs.replace(self.register, invited=(*others, entry)))
        return made

    def renew(
        self, reached: tuple[str, int] | None, keep: Callable[[Invitation], None]
    ) -> list[Invited]:
        """Begin anew with another key: nothing that was signed with the one before counts.

        Whoever may come in now is invited again; who was revoked stays so. The register is written
        last, and by it a desk that runs sees the change. If this ends before, do it again: until
        then both keys may be of different authorities, and certificates are made for nobody.

        Args:
            reached: Where the others find the desk; None: where it listened last.
            keep: Is given each new invitation before anything else is changed.

        Returns:
            Who was invited again.

        Raises:
            SecurityError: A file cannot be written, or nobody knows where the desk is.
        """
        with self._alone():
            self._read()
            good = {each.name for each in self.good()}
            place = self._reached(reached) if good else None
            self._pair = new_authority(f"{self._site} {self.purpose}", self._now)
            entries = []
            for each in self.register.invited:
                if place is not None and each.name in good:
                    each = self._next(each.name, each.role, each)
                    keep(self._invitation(each, place))
                entries.append(each)
            write_private(self._folder / KEY, self._pair.key)
            write_private(self._folder / CERTIFICATE, self._pair.certificate)
            self._write(msgspec.structs.replace(self.register, invited=tuple(entries)))
        return [each for each in entries if each.name in good]

    def _reached(self, given: tuple[str, int] | None) -> tuple[str, int]:
        reached = given or self.register.listened
        if reached is None:
            raise SecurityError(
                "nobody knows yet where the desk is reached: give --address HOST[:PORT], or start "
                f"it once with {self.started_by}"
            )
        return reached

    def _next(self, name: str, role: Role, before: Invited | None) -> Invited:
        until = (self._now + timedelta(days=DAYS)).timestamp()
        return Invited(name, role, before.number + 1 if before else 1, until)

    def _invitation(self, entry: Invited, reached: tuple[str, int]) -> Invitation:
        try:
            pair = self._issued(entry.shown)
        except CertificateError as error:
            raise SecurityError(f"{self._folder}: {error}") from error
        return Invitation(
            site=self._site,
            name=entry.name,
            role=entry.role,
            shown=entry.shown,
            host=reached[0],
            port=reached[1],
            authority=self._pair.certificate.decode(),
            certificate=pair.certificate.decode(),
            key=pair.key.decode(),
        )

    def revoke(self, name: str) -> None:
        """Let nobody in by a certificate of this name; a desk that listens sees it by itself.

        Raises:
            SecurityError: Nobody of this name was invited, or the register cannot be written.
        """
        with self._alone():
            self._read()
            names = [each.name for each in self.register.invited]
            if name not in names:
                raise SecurityError(
                    f"{name}: was not invited; there are: {', '.join(names) or 'none'}"
                )
            invited = tuple(
                msgspec.structs.replace(each, revoked=self._now.timestamp())
                if each.name == name and each.revoked is None
                else each
                for each in self.register.invited
            )
            self._write(msgspec.structs.replace(self.register, invited=invited))

    def good(self) -> list[Invited]:
        """Return who may come in now."""
        return good_of(self.register, self._now)

    def ending(self) -> list[Invited]:
        """Return whose certificate ends soon, the first to end first."""
        soon = (self._now + SOON).timestamp()
        return sorted((e for e in self.good() if e.until < soon), key=lambda e: e.until)

    def outside(self, host: str, port: int) -> Outside:
        """Return what the router needs to listen for other machines, with a new certificate.

        Raises:
            SecurityError: The certificate cannot be made or kept.
        """
        try:
            server = new_server(self._pair, host, self._now)
        except (CertificateError, ValueError) as error:
            raise SecurityError(f"{host}: no certificate can be made for it: {error}") from error
        write_private(self._folder / SERVER_KEY, server.key)
        write_private(self._folder / SERVER_CERTIFICATE, server.certificate)
        self.listened(host, port)
        files = Credentials(
            str(self._folder / CERTIFICATE),
            str(self._folder / SERVER_CERTIFICATE),
            str(self._folder / SERVER_KEY),
        )
        return Outside(Address(host, port), files, access_control(self._site, self.good()))

    def listened(self, host: str, port: int) -> None:
        """Remember where others reach this machine, for invitations.

        Raises:
            SecurityError: It cannot be kept.
        """
        with self._alone():
            self._read()
            if self.register.listened != (host, port):
                self._write(msgspec.structs.replace(self.register, listened=(host, port)))

    def _issued(self, shown: str) -> KeyPair:
        """Return a certificate of this name.

        Raises:
            CertificateError: The authority's own files are no good.
        """
        return new_client(self._pair, shown, self._now)

    def _write(self, register: MemberRegister) -> None:
        write_private(self._folder / REGISTER, msgspec.json.encode(register))
        self.register = register


def read_register(folder: Path) -> MemberRegister:
    """Return who was invited, of an authority's folder.

    Raises:
        SecurityError: Nobody can know.
    """
    file = folder / REGISTER
    try:
        return msgspec.json.decode(file.read_bytes(), type=MemberRegister)
    except FileNotFoundError:
        return MemberRegister()
    except (OSError, msgspec.DecodeError, UnicodeDecodeError) as error:
        raise SecurityError(
            f"{file}: cannot be read, so nobody knows who was invited: {error}"
        ) from error


def good_of(register: MemberRegister, now: datetime) -> list[Invited]:
    """Return who may come in."""
    return [e for e in register.invited if e.revoked is None and e.until > now.timestamp()]


def authority_folder(keys: Path) -> Path:
    """Return where a user's authority is, in the folder of his keys."""
    return Path(os.path.join(keys, "authority"))
