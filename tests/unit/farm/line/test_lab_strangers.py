"""Who may not be in the lab gets nothing through: scheduler, nanny and worker, by real sockets.

Each attacker is counted beside somebody who may, at the same port.
"""

from __future__ import annotations

import asyncio
import socket
import ssl
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import datetime, timedelta, timezone
from pathlib import Path
from threading import Thread

import pytest
from distributed import Client
from distributed.core import rpc
from distributed.security import Security
from farm.config import Credentials
from farm.lab.io.line.guard import LabSecurity, Only
from farm.security.access import Role
from farm.security.certificates import DAYS
from farm.security.io.authority import Authority
from farm.security.io.invitation import Invitation, write_private
from farm.security.io.lab_authority import DESK, LabAuthority
from harness.machines.lab_project import DEADLINE_S, STEADY, Lab
from harness.processes import free_port, wait_until
from scara_bringup.io.ports import listeners, sockets

HOST = "127.0.0.1"
NOW = datetime.now(timezone.utc)
PATIENCE_S = 2.0


@dataclass
class Hall:
    """A lab that runs: its authority, and where scheduler, nanny and worker listen."""

    desk: Lab
    other: Lab
    authority: LabAuthority
    ports: dict[str, int]

    def files(self, invitation: Invitation) -> Credentials:
        """Write what somebody shows."""
        folder = self.desk.folder / f"shown_{invitation.shown.replace(' ', '_')}_{id(invitation)}"
        texts = (invitation.authority, invitation.certificate, invitation.key)
        for name, text in zip(("ca", "crt", "key"), texts):
            write_private(folder / name, text.encode())
        return Credentials(*(str(folder / name) for name in ("ca", "crt", "key")))


@pytest.fixture(scope="module")
def hall(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Hall]:
    """Give all tests one lab with one worker of another machine."""
    folder, port = tmp_path_factory.mktemp("hall"), free_port()
    desk, other = Lab(folder / "desk"), Lab(folder / "other")
    desk.judge(STEADY)
    file = folder / "pc_2.invitation"
    desk.farm("invite", "pc_2", "--lab", "--address", f"{HOST}:{port}", "--file", str(file))
    other.farm("join", str(file))
    kept = desk.start("scheduler", "--port", str(port), "--listen", HOST)
    wait_until(lambda: "use it:" in kept.output, DEADLINE_S, "the scheduler")
    working = other.start("worker", f"tls://{HOST}:{port}", "--workers", "1")
    wait_until(lambda: "1 workers at" in working.output, DEADLINE_S, "the worker")
    authority = LabAuthority(desk.folder / "keys" / "lab", "site", NOW)
    desk_files = authority.desk()
    with Client(f"tls://{HOST}:{port}", security=_as(desk_files), timeout=DEADLINE_S) as client:
        ((address, worker),) = client.scheduler_info()["workers"].items()
        ports = {"scheduler": port, "worker": _port(address), "nanny": _port(worker["nanny"])}
    yield Hall(desk, other, authority, ports)
    other.stage.close()
    desk.stage.close()


def _port(address: str) -> int:
    return int(address.rsplit(":", 1)[1])


def _as(files: Credentials) -> LabSecurity:
    """Return dask's security of somebody who asks nobody who he is."""
    return LabSecurity(files, Only(frozenset({DESK, "pc_2 1"})))


def heard(port: int, context: ssl.SSLContext | None) -> int:
    """Return how many bytes somebody is sent who connects; dask greets whom it lets in."""
    with socket.create_connection((HOST, port), PATIENCE_S) as plain:
        plain.settimeout(PATIENCE_S)
        try:
            if context is None:
                plain.sendall(b"\0" * 64)
                return len(plain.recv(100))
            with context.wrap_socket(plain) as line:
                return len(line.recv(100))
        except (ssl.SSLError, ConnectionError):
            return 0


def shows(files: Credentials | None, authority: str = "") -> ssl.SSLContext:
    """Return TLS of somebody who trusts everybody."""
    context = ssl.create_default_context()
    context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
    if files is not None:
        context.load_cert_chain(files.certificate, files.key)
    return context


def test_strangers_hear_nothing_at_any_port(hall: Hall, tmp_path: Path) -> None:
    """No TLS, no certificate, foreign, ended, of the farm, revoked, and renewed since."""
    where = (HOST, 1)
    past = NOW - timedelta(days=DAYS + 2)
    lab = hall.desk.folder / "keys" / "lab"
    LabAuthority(lab, "site", past).invite("old", Role.LAB, where)
    foreign = LabAuthority(tmp_path / "foreign", "site", NOW)
    farm = Authority(hall.desk.folder / "keys" / "authority", "site", NOW)
    register = LabAuthority(lab, "site", NOW)
    first = register.invite("pc_4", Role.LAB, where)
    register.invite("pc_4", Role.LAB, where)
    gone = register.invite("pc_5", Role.LAB, where)
    register.revoke("pc_5")
    good = register.invite("pc_6", Role.LAB, where)
    ended = LabAuthority(lab, "site", past)
    strangers = {
        "no TLS": None,
        "no certificate": shows(None),
        "of another lab": shows(hall.files(foreign.invite("pc_2", Role.LAB, where))),
        "another lab's desk": shows(foreign.desk()),
        "ended": shows(hall.files(ended.invite("old", Role.LAB, where))),
        "of the farm": shows(hall.files(farm.invite("pc_2", Role.MACHINE, where))),
        "a desk of the farm": shows(hall.files(farm.invite("laptop", Role.DESK, where))),
        "renewed since": shows(hall.files(first)),
        "revoked": shows(hall.files(gone)),
    }
    got = {(who, at): heard(p, c) for who, c in strangers.items() for at, p in hall.ports.items()}
    assert len(got) == 27 and {key: count for key, count in got.items() if count} == {}
    desk = {at: heard(port, shows(hall.authority.desk())) for at, port in hall.ports.items()}
    assert all(desk.values()), desk
    # A member may ask the scheduler, but workers of others obey the desk alone.
    member = {at: heard(port, shows(hall.files(good))) for at, port in hall.ports.items()}
    assert [at for at, count in member.items() if count] == ["scheduler"]


def test_dask_itself_refuses_them(hall: Hall, tmp_path: Path) -> None:
    """By the library's own client and calls, with a foreign certificate; the desk's is obeyed."""
    foreign = LabAuthority(tmp_path / "foreign", "site", NOW).desk()

    async def named(port: int, files: Credentials) -> str:
        args = Security(
            require_encryption=True,
            tls_ca_file=files.authority,
            tls_client_cert=files.certificate,
            tls_client_key=files.key,
        ).get_connection_args("client")
        asked = rpc(f"tls://{HOST}:{port}", timeout=PATIENCE_S, connection_args=args)
        try:
            return str((await asyncio.wait_for(asked.identity(), DEADLINE_S))["id"])
        finally:
            await asked.close_rpc()

    for port in hall.ports.values():
        with pytest.raises((OSError, asyncio.TimeoutError)):
            asyncio.run(named(port, foreign))
        assert asyncio.run(named(port, hall.authority.desk()))


def test_a_worker_works_for_the_desk_alone(hall: Hall) -> None:
    """A scheduler with the certificate of another member is none, though of the same authority."""
    register = LabAuthority(hall.desk.folder / "keys" / "lab", "site", NOW)
    files = hall.files(register.invite("pc_7", Role.LAB, (HOST, 1)))
    context = ssl.create_default_context(ssl.Purpose.CLIENT_AUTH)
    context.load_cert_chain(files.certificate, files.key)
    got: list[bytes] = []
    with socket.create_server((HOST, 0)) as server:

        def pretend() -> None:
            plain, _ = server.accept()
            plain.settimeout(DEADLINE_S)
            with plain:
                try:
                    with context.wrap_socket(plain, server_side=True) as line:
                        got.append(line.recv(100))
                except OSError:
                    got.append(b"")

        thread = Thread(target=pretend)
        thread.start()
        address = f"tls://{HOST}:{server.getsockname()[1]}"
        refused = hall.other.start("worker", address, "--workers", "1")
        assert refused.wait(DEADLINE_S) == 1, refused.output
        thread.join(DEADLINE_S)
    assert got == [b""] and "does not let this machine in" in refused.output


def test_all_that_listens_asks_for_certificates(hall: Hall) -> None:
    """Beside scheduler, worker and nanny there are dask's own pages: they are on loopback."""
    inodes = {listener.inode: listener for listener in listeners()}
    stages = (hall.desk.stage, hall.other.stage)
    ours = {int(line.split()[0]) for stage in stages for line in stage.left_over()}
    seen = [inodes[i] for pid, _, held in sockets() if pid in ours for i in held & set(inodes)]
    assert len(seen) >= len(hall.ports) and all(each.is_loopback for each in seen)
