"""A desk that listens for other machines: who may not come in gets nothing through.

Each attacker is counted beside a machine that may come in, on the same router.
"""

from __future__ import annotations

import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from datetime import datetime, timedelta, timezone
from pathlib import Path

import msgspec
import pytest
import zenoh
from farm.bus_io import BusError, open_client
from farm.config import Address, Credentials, SecureAddress
from farm.desk.commands_io import cells_there, order
from farm.security import door_io as door
from farm.security.access import Role
from farm.security.authority_io import CERTIFICATE, KEY, REGISTER, SiteAuthority
from farm.security.certificates import DAYS, KeyPair, new_client
from farm.security.door_io import MemberDoor
from farm.security.invitation_io import Invitation, write_private
from farm.security.lab_authority_io import LabAuthority
from farm.wire import Answer, Joints
from harness.processes import free_port, wait_until
from unit.farm.conftest import Farm, Journal

from farm import keys

DEADLINE_S, QUIET_S = 10.0, 0.4
HOST = "127.0.0.1"
NOW = datetime.now(timezone.utc)
GOOD, OTHER = keys.CellName("site", "pc_1", "a"), keys.CellName("site", "pc_2", "b")


@dataclass
class Site:
    """A desk with its authority, and all that it was sent."""

    farm: Farm
    folder: Path
    port: int
    authority: SiteAuthority
    heard: list[tuple[str, bytes]] = field(default_factory=list)
    door: MemberDoor | None = None

    def invite(self, name: str, role: Role = Role.MACHINE) -> Invitation:
        """Invite somebody."""
        return self.authority.invite(name, role, (HOST, self.port))

    def address(self, invitation: Invitation, **changed: str) -> SecureAddress:
        """Return where a machine with this invitation connects, with files of its own."""
        shown = msgspec.structs.replace(invitation, **changed)
        folder = self.folder / f"machine_{len(list(self.folder.iterdir()))}"
        for name, text in (
            ("ca", shown.authority),
            ("certificate", shown.certificate),
            ("key", shown.key),
        ):
            write_private(folder / name, text.encode())
        files = Credentials(*(str(folder / name) for name in ("ca", "certificate", "key")))
        return SecureAddress(HOST, self.port, files)

    def come_in(self, address: Address) -> zenoh.Session:
        """Connect as a link does."""
        return self.farm.ends.enter_context(open_client(address, self.farm.config.lease_ms, 5.0))

    def listen(self) -> zenoh.Session:
        """Open the router for all who are invited now, and hear all that comes."""
        config = self.farm.config
        router = self.farm.router()
        folder = self.folder.parent / "authority"
        self.door = self.farm.ends.enter_context(MemberDoor(config, folder, (HOST, self.port)))
        router.declare_subscriber(
            "**", lambda s: self.heard.append((str(s.key_expr), bytes(s.payload)))
        )
        return router

    def through(self, marks: set[bytes]) -> list[str]:
        """Return where something came through of what strangers have sent."""
        return [key for key, payload in self.heard if payload in marks]


@pytest.fixture
def site(farm: Farm, tmp_path: Path) -> Site:
    """Give a site; nobody listens yet."""
    authority = SiteAuthority(tmp_path / "authority", "site", NOW)
    (tmp_path / "machines").mkdir()
    return Site(farm, tmp_path / "machines", free_port(), authority)


def test_a_machine_that_was_invited_is_a_cell_like_any(site: Site) -> None:
    """Shown, asked, looked at; and gone when its connection is."""
    invited = site.invite("pc_1")
    router = site.listen()
    session = open_client(site.address(invited), site.farm.config.lease_ms, 5.0)
    link = site.farm.link(session, Journal(), cell=GOOD)
    wait_until(lambda: cells_there(router, "site", 1.0) == [GOOD], DEADLINE_S, "the cell")
    (answer,) = order(router, [GOOD], "STOP", "ann", "desk", 2.0)
    assert answer.answer == Answer(True, "STOP received")
    looking = router.declare_subscriber(GOOD.key(keys.JOINTS), lambda _: None)
    wait_until(lambda: site.farm.watched == [True], DEADLINE_S, "somebody who looks")
    link.show_joints(Joints(1.0, {"joint_1": 0.5}, {}))
    wait_until(lambda: GOOD.key(keys.JOINTS) in dict(site.heard), DEADLINE_S, "the joints")
    looking.undeclare()
    link.close()
    session.close()
    wait_until(lambda: not cells_there(router, "site", 1.0), DEADLINE_S, "its end")


def test_who_shows_no_good_certificate_does_not_come_in(site: Site, tmp_path: Path) -> None:
    """None, of another authority, ended, or with another's key."""
    good, other = site.invite("pc_1"), site.invite("pc_2")
    past = NOW - timedelta(days=DAYS + 2)
    # The same authority, at another time.
    who = "pc_1", Role.MACHINE, (HOST, 1)
    ended = SiteAuthority(tmp_path / "authority", "site", past).invite(*who)
    foreign = SiteAuthority(tmp_path / "foreign", "site", NOW).invite(*who)
    lab = LabAuthority(tmp_path / "lab", "site", NOW).invite("pc_1", Role.LAB, (HOST, 1))
    site.authority = SiteAuthority(tmp_path / "authority", "site", NOW)
    good = site.invite("pc_1")
    site.listen()
    strangers = {
        "another authority": {"certificate": foreign.certificate, "key": foreign.key},
        "of the lab": {"certificate": lab.certificate, "key": lab.key},
        "ended": {"certificate": ended.certificate, "key": ended.key},
        "another's key": {"key": other.key},
        "another's certificate": {"certificate": other.certificate},
    }
    addresses = [site.address(good, **shown) for shown in strangers.values()]

    def refused(address: SecureAddress) -> bool:
        with pytest.raises(BusError, match="takes this machine's certificate no more"):
            open_client(address, 1000.0, 1.0)
        return True

    with ThreadPoolExecutor() as pool:
        assert list(pool.map(refused, addresses)) == [True] * len(strangers)
    bare = zenoh.Config()
    for key, value in (
        ("mode", '"client"'),
        ("scouting/multicast/enabled", "false"),
        ("transport/shared_memory/enabled", "false"),
        ("connect/endpoints", f'["tls/{HOST}:{site.port}"]'),
        ("connect/timeout_ms", "1000"),
        ("connect/exit_on_failure", "true"),
        (
            "transport/link/tls/root_ca_certificate",
            f'"{tmp_path / "authority" / "authority.crt"}"',
        ),
    ):
        bare.insert_json5(key, value)
    with pytest.raises(zenoh.ZError):
        zenoh.open(bare)
    assert site.heard == []
    # The same machine with its own certificate: it is not the address.
    site.come_in(site.address(good)).put(GOOD.key(keys.STATE), b"good")
    wait_until(lambda: site.through({b"good"}), DEADLINE_S, "the one who may come in")


def test_a_machine_sends_under_its_own_name_alone(site: Site) -> None:
    """Forged states, tokens, events, and those of one whose certificate was revoked."""
    good, other, revoked = (site.invite(name) for name in ("pc_1", "pc_2", "pc_3"))
    site.authority.revoke("pc_3")
    router = site.listen()
    sent = 0
    for invited, own in ((other, "pc_2"), (revoked, "")):
        session = site.come_in(site.address(invited))
        for what in (keys.STATE, keys.EVENT, keys.HEALTH, keys.JOINTS):
            for key in (GOOD.key(what), f"site/desk/x/{what}", "site/**", what):
                session.put(key, b"forged")
                sent += 1
        session.liveliness().declare_token(GOOD.key(keys.ALIVE))
        session.delete(GOOD.key(keys.STATE))
        for what in (keys.STATE, keys.EVENT):
            session.put(keys.CellName("site", own or "pc_3", "b").key(what), b"own")
    honest = site.come_in(site.address(good))
    honest.put(GOOD.key(keys.STATE), b"good")
    wait_until(lambda: site.through({b"good"}), DEADLINE_S, "the honest state")
    wait_until(lambda: len(site.through({b"own"})) == 2, DEADLINE_S, "the other's own")
    time.sleep(QUIET_S)  # what must not come has time to come
    assert sent == 32 and site.through({b"forged"}) == []
    assert sorted(site.through({b"own"})) == [OTHER.key(keys.EVENT), OTHER.key(keys.STATE)]
    assert cells_there(router, "site", 0.5) == []


def test_a_machine_keeps_no_stop_from_the_others_by_its_tokens(site: Site) -> None:
    """What names no cell is passed over and counted; all others are shown and asked."""
    good, other = site.invite("pc_1"), site.invite("pc_2")
    router = site.listen()
    desk = site.farm.desk(router)
    liveliness = site.come_in(site.address(other)).liveliness()
    tokens = [liveliness.declare_token(key) for key in ("site/pc_2/**", "site/pc_2/*/alive")]
    wait_until(lambda: desk.unreadable >= len(tokens), DEADLINE_S, "the tokens")
    site.farm.link(site.come_in(site.address(good)), Journal(), cell=GOOD)
    there = wait_until(lambda: cells_there(router, "site", 1.0), DEADLINE_S, "the cell")
    (answer,) = order(router, there, "STOP", "ann", "desk", 2.0)
    assert (answer.cell, answer.answer) == (GOOD, Answer(True, "STOP received"))
    wait_until(lambda: [row.name for row in desk.rows()] == [str(GOOD)], DEADLINE_S, "its row")


def test_a_machine_neither_spies_nor_commands(site: Site) -> None:
    """What others show does not reach it, and its questions reach no cell; a desk's do."""
    good, other, desk = site.invite("pc_1"), site.invite("pc_2"), site.invite("lap", Role.DESK)
    router = site.listen()
    link = site.farm.link(site.come_in(site.address(good)), Journal(), cell=GOOD)
    spy, guest = (site.come_in(site.address(each)) for each in (other, desk))
    heard: dict[str, list[str]] = {"spy": [], "guest": []}
    for name, session in (("spy", spy), ("guest", guest)):
        for key in ("**", GOOD.key(keys.JOINTS), "site/*/*/joints"):
            session.declare_subscriber(
                key, lambda sample, name=name: heard[name].append(str(sample.key_expr))
            )
    wait_until(lambda: cells_there(router, "site", 1.0) == [GOOD], DEADLINE_S, "the cell")
    wait_until(lambda: site.farm.watched == [True], DEADLINE_S, "the guest who looks")
    link.show_joints(Joints(1.0, {"joint_1": 0.5}, {}))
    wait_until(lambda: GOOD.key(keys.JOINTS) in heard["guest"], DEADLINE_S, "what a desk hears")
    (asked,) = order(spy, [GOOD], "STOP", "eve", "pc_2", 0.5)
    assert asked.answer is None and site.farm.obeyed == []
    for key in (GOOD.key(keys.EVENTS), GOOD.key(keys.RECORDINGS), "site/*/*/command"):
        assert [reply for reply in spy.get(key, timeout=0.5) if reply.ok is not None] == []
    assert list(spy.liveliness().get("site/*/*/alive", timeout=0.5)) == []
    (answered,) = order(guest, [GOOD], "STOP", "ann", "lap", 2.0)
    assert answered.answer == Answer(True, "STOP received")
    assert heard["spy"] == [] and [c.person for c in site.farm.obeyed] == ["ann"]


def test_a_stranger_at_the_open_port_gets_nothing_without_tls(site: Site) -> None:
    """The port for machines speaks TLS alone; loopback stays as it was."""
    site.listen()
    plain = Address(HOST, site.port)
    with pytest.raises(BusError, match="no desk answers"):
        open_client(plain, 1000.0, 1.0)
    session = site.farm.client()
    session.put("site/here/a/state", b"here")
    wait_until(lambda: site.through({b"here"}), DEADLINE_S, "this machine")


AUTHORITY = (KEY, CERTIFICATE)
OUT_S = 2.0
"""The promise: who is revoked is out so soon."""


def test_a_machine_that_is_revoked_is_out_at_once(site: Site) -> None:
    """While the desk goes on; the others come back by themselves, and this machine never left."""
    good, bad = site.invite("pc_1"), site.invite("pc_2")
    router = site.listen()
    here = keys.CellName("site", "here", "c")
    site.farm.link(site.farm.client(), Journal(), cell=here)
    sessions = {cell: site.come_in(site.address(who)) for cell, who in ((GOOD, good), (OTHER, bad))}
    for cell, session in sessions.items():
        site.farm.link(session, Journal(), cell=cell)
    everybody = [here, GOOD, OTHER]
    wait_until(lambda: cells_there(router, "site", 1.0) == everybody, DEADLINE_S, "all cells")
    lost: list[str] = []
    router.liveliness().declare_subscriber(
        here.key(keys.ALIVE), lambda sample: lost.append(str(sample.kind))
    )
    site.authority.revoke("pc_2")
    revoked = time.monotonic()
    wait_until(lambda: OTHER not in cells_there(router, "site", 1.0), DEADLINE_S, "its end")
    assert time.monotonic() - revoked < OUT_S
    wait_until(lambda: GOOD in cells_there(router, "site", 1.0), DEADLINE_S, "the other again")
    assert time.monotonic() - revoked < 2 * OUT_S
    # A machine that comes again is told of who looks at its site, and of nobody else.
    looking = router.declare_subscriber("site/**", lambda _: None)
    # The other may try for as long as it likes, with its old line and with a new one.
    again = site.come_in(site.address(bad))

    def heard() -> list[str]:
        for session in (sessions[OTHER], again):
            session.put(OTHER.key(keys.STATE), b"forged")
        sessions[GOOD].put(GOOD.key(keys.STATE), b"good")
        return site.through({b"good"})

    wait_until(lambda: len(heard()) > 20, DEADLINE_S, "the honest state")
    assert site.through({b"forged"}) == []
    answers = list(order(router, [here, GOOD, OTHER], "STOP", "ann", "desk", DEADLINE_S))
    accepted = {a.cell for a in answers if a.answer is not None and a.answer.accepted}
    assert accepted == {here, GOOD} and lost == []
    looking.undeclare()


def test_a_machine_that_is_invited_comes_in_at_once(site: Site) -> None:
    """Nobody starts the desk anew; what its name had before is out with that."""
    first = site.invite("pc_1")
    router = site.listen()
    second = site.invite("pc_1")
    wait_until(lambda: site.door.names == ("pc_1 2",), DEADLINE_S, "the door")
    old, new = (site.come_in(site.address(each)) for each in (first, second))
    old.put(GOOD.key(keys.STATE), b"old")
    new.put(GOOD.key(keys.STATE), b"new")
    wait_until(lambda: site.through({b"new"}), DEADLINE_S, "the new one")
    time.sleep(QUIET_S)
    assert site.through({b"old"}) == [] and router.info is not None


@pytest.mark.parametrize(("part", "damaged"), [(b"{", b""), (b"pc_1", b"pc\xff1")])
def test_nobody_comes_in_while_nobody_knows_who_may(
    part: bytes,
    damaged: bytes,
    site: Site,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A register that cannot be read closes the door, not the desk; whole again, it opens."""
    monkeypatch.setattr(door, "AGAIN_S", door.LOOK_S)
    invited = site.invite("pc_1")
    site.listen()
    file = site.folder.parent / "authority" / REGISTER
    whole = file.read_bytes()
    file.write_bytes(whole.replace(part, damaged))
    wait_until(lambda: site.door.names is None, DEADLINE_S, "a closed door")
    with pytest.raises(BusError):
        open_client(site.address(invited), 1000.0, 0.3)
    site.farm.client().put("site/here/a/state", b"here")
    wait_until(lambda: site.through({b"here"}), DEADLINE_S, "this machine")
    write_private(file, whole)
    wait_until(lambda: site.door.names == ("pc_1 1",), DEADLINE_S, "an open door")
    site.come_in(site.address(invited)).put(GOOD.key(keys.STATE), b"good")
    wait_until(lambda: site.through({b"good"}), DEADLINE_S, "who may come in")
    assert capsys.readouterr().err.count("nobody comes in: ") == 1


def test_a_stolen_key_of_the_authority_opens_nothing_once_all_is_renewed(site: Site) -> None:
    """A job of the lab runs as the desk's owner, so it can read that key; the desk goes on."""
    site.invite("pc_1")
    thief = KeyPair(*((site.folder.parent / "authority" / name).read_bytes() for name in AUTHORITY))

    def forged(name: str) -> Invitation:
        made = new_client(thief, name, NOW)
        return msgspec.structs.replace(
            site.invite("pc_9"),
            certificate=made.certificate.decode(),
            key=made.key.decode(),
            authority=(site.folder.parent / "authority" / AUTHORITY[1]).read_text(),
        )

    site.listen()
    # It really is a key to everything: this is why there is a word to renew all.
    site.come_in(site.address(forged("pc_1 1"))).put(GOOD.key(keys.STATE), b"thief")
    wait_until(lambda: site.through({b"thief"}), DEADLINE_S, "the thief, before")
    kept: list[Invitation] = []
    site.authority.renew((HOST, site.port), kept.append)
    new = next(each for each in kept if each.name == "pc_1")
    wait_until(lambda: new.shown in (site.door.names or ()), DEADLINE_S, "the new keys")
    site.heard.clear()
    with pytest.raises(BusError, match="takes this machine's certificate no more"):
        open_client(site.address(forged(new.shown)), 1000.0, 1.0)
    site.come_in(site.address(new)).put(GOOD.key(keys.STATE), b"good")
    wait_until(lambda: site.through({b"good"}), DEADLINE_S, "who was invited again")
    assert site.through({b"thief"}) == []


def test_a_door_that_lets_nobody_in_takes_the_new_authority_too(site: Site) -> None:
    """Its names do not change by that."""
    site.listen()
    before = site.door._authority
    site.authority.renew((HOST, site.port), lambda _: None)
    wait_until(lambda: site.door._authority != before, DEADLINE_S, "the new authority")
    wait_until(lambda: site.door.names == (), DEADLINE_S, "an open door")
