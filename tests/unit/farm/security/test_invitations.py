"""The authority invites, a machine joins; what does not fit is refused with the reason."""

from __future__ import annotations

import json
import stat
from concurrent.futures import ThreadPoolExecutor
from datetime import datetime, timedelta, timezone
from pathlib import Path

import msgspec
import pytest
from cryptography import x509
from farm.config import (
    Address,
    Credentials,
    Outside,
    ReachedError,
    SecureAddress,
    load_farm,
    reached,
)
from farm.security.access import Invited, Role, access_control
from farm.security.authority_io import SiteAuthority, read_register
from farm.security.certificates import (
    DAYS,
    CertificateError,
    KeyPair,
    check,
    new_authority,
    new_client,
)
from farm.security.invitation_io import Invitation, SecurityError, write_private
from farm.security.lab_authority_io import LabAuthority, has_lab
from farm.security.membership_io import as_member, join, joined, leave
from harness.workspace import ROOT

NOW = datetime(2026, 3, 1, tzinfo=timezone.utc)
WHERE = ("10.0.0.5", 7448)


def invited(
    folder: Path, name: str = "pc_2", role: Role = Role.MACHINE, at: datetime = NOW
) -> tuple[Path, Invitation]:
    """Return an invitation of the authority in ``folder``, as a file and as it was made."""
    made = SiteAuthority(folder / "authority", "hall", at).invite(name, role, WHERE)
    file = folder / f"{name}.invitation"
    write_private(file, msgspec.json.encode(made))
    return file, made


def test_a_machine_that_joined_comes_in_under_its_name(tmp_path: Path) -> None:
    """Site, machine and desk are those of the invitation; private files are the owner's alone."""
    file, _ = invited(tmp_path)
    keys = tmp_path / "keys"
    assert joined(keys) is None and as_member(load_farm(ROOT / "config"), keys, NOW).machine is None
    join(keys, file, NOW)
    config = as_member(load_farm(ROOT / "config"), keys, NOW)
    assert (config.site, config.machine) == ("hall", "pc_2")
    assert isinstance(config.router, SecureAddress)
    assert config.router.endpoint == "tls/10.0.0.5:7448" and not config.router.refusal
    private = [keys / "member" / "own.key", tmp_path / "authority" / "authority.key", file]
    assert [stat.S_IMODE(path.stat().st_mode) for path in private] == [0o600] * 3
    assert leave(keys) and not leave(keys) and joined(keys) is None


def test_a_desk_keeps_its_own_machine_name(tmp_path: Path) -> None:
    """It has no cells there, and asks under its certificate."""
    file, _ = invited(tmp_path, "laptop", Role.DESK)
    join(tmp_path / "keys", file, NOW)
    assert as_member(load_farm(ROOT / "config"), tmp_path / "keys", NOW).machine is None


@pytest.mark.parametrize("days", [-1, DAYS + 1])
def test_a_certificate_is_good_for_its_time(tmp_path: Path, days: int) -> None:
    """Neither before nor after; it says from when to when."""
    file, _ = invited(tmp_path)
    with pytest.raises(SecurityError, match="good from 2026-02-28 to 2026-05-30"):
        join(tmp_path / "keys", file, NOW + timedelta(days=days))
    assert joined(tmp_path / "keys") is None
    join(tmp_path / "keys", file, NOW)
    with pytest.raises(SecurityError, match="ask for another invitation"):
        as_member(load_farm(ROOT / "config"), tmp_path / "keys", NOW + timedelta(days=days))


def test_only_the_authority_signs_certificates() -> None:
    """What it signs is good for showing who one is, and for nothing else."""
    authority = new_authority("hall", NOW)
    for pair, signs in ((authority, True), (new_client(authority, "pc_2 1", NOW), False)):
        found = x509.load_pem_x509_certificate(pair.certificate).extensions
        usage = found.get_extension_for_class(x509.KeyUsage).value
        assert (usage.key_cert_sign, usage.digital_signature) == (signs, not signs)
        others = (usage.content_commitment, usage.key_encipherment, usage.data_encipherment)
        assert not any((*others, usage.key_agreement, usage.crl_sign))
        assert found.get_extension_for_class(x509.BasicConstraints).value.ca is signs


def test_what_was_put_together_is_refused(tmp_path: Path) -> None:
    """Another authority's certificate, another's key, another name, no invitation at all."""
    file, good = invited(tmp_path)
    _, other = invited(tmp_path, "pc_3")
    _, foreign = invited(tmp_path / "foreign")
    wrong = {
        "not of the authority": {"authority": foreign.authority},
        "not that of the certificate": {"key": other.key},
        "is of pc_3 1, not of pc_2 1": {"certificate": other.certificate, "key": other.key},
        "private key cannot be read": {"key": "-----"},
        "certificate cannot be read": {"certificate": "-----"},
    }
    for said, change in wrong.items():
        file.write_bytes(msgspec.json.encode(msgspec.structs.replace(good, **change)))
        with pytest.raises(SecurityError, match=said):
            join(tmp_path / "keys", file, NOW)
    for text in ("", "{}", json.dumps({"site": "a/b"})):
        file.write_text(text)
        with pytest.raises(SecurityError, match="is no invitation"):
            join(tmp_path / "keys", file, NOW)
    with pytest.raises(SecurityError, match="No such file"):
        join(tmp_path / "keys", tmp_path / "missing", NOW)
    assert joined(tmp_path / "keys") is None


def test_a_revoked_name_and_an_older_certificate_have_no_place(tmp_path: Path) -> None:
    """A new invitation replaces the one before; what was revoked stays out until it is renewed."""
    authority = SiteAuthority(tmp_path / "authority", "hall", NOW)
    first = authority.invite("pc_2", Role.MACHINE, WHERE)
    second = authority.invite("pc_2", Role.MACHINE, None or WHERE)
    assert (first.shown, second.shown) == ("pc_2 1", "pc_2 2")

    def let_in() -> list[str]:
        subjects = authority.outside(*WHERE).access["subjects"]
        return [name for each in subjects for name in each.get("cert_common_names", [])]

    assert let_in() == ["pc_2 2"]
    authority.revoke("pc_2")
    assert let_in() == [] and authority.good() == []
    assert authority.invite("pc_2", Role.MACHINE, None).shown == "pc_2 3"
    assert let_in() == ["pc_2 3"]
    with pytest.raises(SecurityError, match="was not invited; there are: pc_2"):
        authority.revoke("pc_9")


def test_what_two_do_at_once_is_not_undone(tmp_path: Path) -> None:
    """The file counts, as it is when it is changed: an invitation undoes no revocation."""
    desk, person = (SiteAuthority(tmp_path / "authority", "hall", NOW) for _ in range(2))
    person.invite("pc_2", Role.MACHINE, WHERE)
    desk.invite("pc_3", Role.MACHINE, WHERE)
    person.revoke("pc_2")
    desk.outside("127.0.0.2", 7001)
    desk.invite("pc_4", Role.MACHINE, WHERE)
    found = read_register(tmp_path / "authority")
    assert [(each.name, each.revoked is None) for each in found.invited] == [
        ("pc_2", False),
        ("pc_3", True),
        ("pc_4", True),
    ]
    with ThreadPoolExecutor(8) as pool:
        made = [SiteAuthority(tmp_path / "authority", "hall", NOW) for _ in range(8)]
        list(pool.map(lambda k: made[k].invite(f"other_{k}", Role.MACHINE, WHERE), range(8)))
    assert len(read_register(tmp_path / "authority").invited) == 11


def test_an_authority_is_kept_and_watched(tmp_path: Path) -> None:
    """It is the same the next time; a key that others can read is not used; ends are told of."""
    first = SiteAuthority(tmp_path / "a", "hall", NOW).invite("pc_2", Role.MACHINE, WHERE)
    again = SiteAuthority(tmp_path / "a", "hall", NOW + timedelta(days=DAYS - 10))
    assert again.invite("pc_3", Role.MACHINE, WHERE).authority == first.authority
    assert [each.name for each in again.ending()] == ["pc_2"]
    assert [
        e.name for e in SiteAuthority(tmp_path / "a", "hall", NOW + timedelta(days=DAYS)).good()
    ] == ["pc_3"]
    (tmp_path / "a" / "authority.key").chmod(0o644)
    with pytest.raises(SecurityError, match="others can read it"):
        SiteAuthority(tmp_path / "a", "hall", NOW)
    with pytest.raises(SecurityError, match="nobody knows yet where the desk is"):
        SiteAuthority(tmp_path / "b", "hall", NOW).invite("pc_2", Role.MACHINE, None)
    (tmp_path / "b" / "invited.json").write_text("[")
    with pytest.raises(SecurityError, match="nobody knows who was invited"):
        SiteAuthority(tmp_path / "b", "hall", NOW)


def test_a_machine_gets_its_own_keys_and_nothing_else() -> None:
    """Each rule that lets in what a machine sends holds its own keys alone."""
    made = access_control(
        "hall", [Invited("pc_2", Role.MACHINE, 1, 0.0), Invited("a", Role.DESK, 1, 0.0)]
    )
    assert made["enabled"] and made["default_permission"] == "deny"
    rules = {rule["id"]: rule for rule in made["rules"]}
    policies = {policy["subjects"][0]: policy["rules"] for policy in made["policies"]}
    sent = [rules[name] for name in policies["machine pc_2"] if "ingress" in rules[name]["flows"]]
    assert [rule["key_exprs"] for rule in sent] == [["hall/pc_2/**"]]
    assert not {"query", "declare_subscriber"} & {m for rule in sent for m in rule["messages"]}
    assert policies["desk a"] == ["everything"]


def test_where_a_desk_is_reached() -> None:
    """An address that means any is nowhere to go."""
    assert reached("hall-pc") == ("hall-pc", 7448)
    for wrong in ("", ":5", "a:", "a:0", "a:99999", "0.0.0.0", "[::]:7448"):
        with pytest.raises(ReachedError):
            reached(wrong)


def test_the_lab_has_an_authority_of_its_own(tmp_path: Path) -> None:
    """Joining one does not leave the other; neither gives what is the other's."""
    keys = tmp_path / "keys"
    assert not has_lab(keys)
    lab = LabAuthority(keys / "lab", "hall", NOW)
    made = lab.invite("pc_2", Role.LAB, WHERE)
    assert has_lab(keys) and made.role is Role.LAB
    farm_file, _ = invited(tmp_path)
    lab_file = tmp_path / "lab.invitation"
    write_private(lab_file, msgspec.json.encode(made))
    join(keys, farm_file, NOW)
    join(keys, lab_file, NOW)
    seen = joined(keys), joined(keys, lab=True)
    assert [each and each.role for each in seen] == [Role.MACHINE, Role.LAB]
    assert leave(keys, lab=True) and joined(keys, lab=True) is None and joined(keys) is not None
    farm = SiteAuthority(tmp_path / "authority", "hall", NOW)
    for authority, role in ((farm, Role.LAB), (lab, Role.MACHINE), (lab, Role.DESK)):
        with pytest.raises(SecurityError, match="gives no such"):
            authority.invite("pc_3", role, WHERE)
    own = Path(lab.desk().certificate)
    assert stat.S_IMODE(own.stat().st_mode) == 0o600 and lab.desk().key == str(own)


def test_a_renewed_authority_forgets_what_it_has_signed(tmp_path: Path) -> None:
    """Who may come in is invited again, by another key; who was revoked or ended is not."""
    for kind, role in ((SiteAuthority, Role.MACHINE), (LabAuthority, Role.LAB)):
        folder = tmp_path / role.name
        kind(folder, "hall", NOW - timedelta(days=DAYS)).invite("pc_9", role, WHERE)
        authority = kind(folder, "hall", NOW)
        old = authority.invite("pc_2", role, WHERE)
        authority.invite("pc_3", role, WHERE)
        authority.revoke("pc_3")
        key = (folder / "authority.key").read_bytes()
        kept: list[Invitation] = []
        assert [each.name for each in authority.renew(WHERE, kept.append)] == ["pc_2"]
        (new,) = kept
        assert (new.shown, new.role, new.site) == ("pc_2 2", role, "hall")
        assert (folder / "authority.key").read_bytes() != key and new.authority != old.authority
        assert stat.S_IMODE((folder / "authority.key").stat().st_mode) == 0o600
        again = kind(folder, "hall", NOW)
        assert [each.shown for each in again.good()] == ["pc_2 2"]
        assert {e.name for e in again.register.invited} == {"pc_2", "pc_3", "pc_9"}
        check(new.authority.encode(), pair_of(new), "pc_2 2", NOW)
        with pytest.raises(CertificateError, match="not of the authority"):
            check(new.authority.encode(), pair_of(old), "pc_2 1", NOW)


def pair_of(invitation: Invitation) -> KeyPair:
    """Return what somebody shows with an invitation."""
    return KeyPair(invitation.key.encode(), invitation.certificate.encode())


def test_the_labs_desk_shows_what_the_new_authority_has_signed(tmp_path: Path) -> None:
    """Its own certificate may have been read, too."""
    lab = LabAuthority(tmp_path / "lab", "hall", NOW)
    own = Path(lab.desk().certificate)
    before = own.read_bytes()
    lab.renew(None, lambda _: None)
    after = Path(LabAuthority(tmp_path / "lab", "hall", NOW).desk().certificate).read_bytes()
    assert after != before
    authority = (tmp_path / "lab" / "authority.crt").read_bytes()
    check(authority, KeyPair(after, after), "lab desk", NOW)
    with pytest.raises(CertificateError):
        check(authority, KeyPair(before, before), "lab desk", NOW)


@pytest.mark.parametrize("fails_at", [1, 2, 3])
def test_renewing_that_was_interrupted_is_done_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, fails_at: int
) -> None:
    """Wherever it ended, the second time makes all of it whole."""
    from farm.security import authority_io as module

    folder = tmp_path / "authority"
    SiteAuthority(folder, "hall", NOW).invite("pc_2", Role.MACHINE, WHERE)
    written = 0

    def full(file: Path, content: bytes) -> None:
        nonlocal written
        written += 1
        if written == fails_at:
            raise SecurityError(f"{file}: No space left on device")
        write_private(file, content)

    with monkeypatch.context() as patched:
        patched.setattr(module, "write_private", full)
        with pytest.raises(SecurityError, match="No space left"):
            SiteAuthority(folder, "hall", NOW).renew(WHERE, lambda _: None)
    kept: list[Invitation] = []
    SiteAuthority(folder, "hall", NOW).renew(WHERE, kept.append)
    authority = (folder / "authority.crt").read_bytes()
    check(authority, pair_of(kept[0]), "pc_2 2", NOW)
    later = SiteAuthority(folder, "hall", NOW).invite("pc_4", Role.MACHINE, WHERE)
    check(authority, pair_of(later), "pc_4 1", NOW)


def test_nobody_is_renewed_where_nobody_knows_the_desk(tmp_path: Path) -> None:
    """Before anything is changed."""
    folder = tmp_path / "authority"
    SiteAuthority(folder, "hall", NOW).invite("pc_2", Role.MACHINE, WHERE)
    key = (folder / "authority.key").read_bytes()
    with pytest.raises(SecurityError, match="nobody knows yet where the desk is"):
        SiteAuthority(folder, "hall", NOW).renew(None, lambda _: None)
    assert (folder / "authority.key").read_bytes() == key


def test_both_ends_of_a_link_between_machines_show_certificates() -> None:
    """Whoever connects looks at the router's name too; a certificate that runs out ends a link."""
    files, tls = Credentials("authority", "certificate", "key"), "transport/link/tls"
    machine = SecureAddress("router", 7447, files)
    for end in (machine, Outside(Address("router", 7447), files, {})):
        assert end.endpoint == "tls/router:7447"
        assert end.settings[f"{tls}/root_ca_certificate"] == "authority"
        assert end.settings[f"{tls}/enable_mtls"] is True
        assert end.settings[f"{tls}/close_link_on_expiration"] is True
    assert machine.settings[f"{tls}/verify_name_on_connect"] is True


def test_a_certificate_is_good_an_hour_before_it_was_made(tmp_path: Path) -> None:
    """The other machine's clock may be behind; by more than that it is wrong."""
    file, _ = invited(tmp_path)
    with pytest.raises(SecurityError, match="good from"):
        join(tmp_path / "keys", file, NOW - timedelta(minutes=61))
    join(tmp_path / "keys", file, NOW - timedelta(minutes=59))
