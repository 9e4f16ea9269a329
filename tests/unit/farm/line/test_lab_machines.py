"""A lab over TLS: other machines do its jobs with the same results, and strangers are kept out."""

from __future__ import annotations

import socket
import ssl
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import datetime, timedelta, timezone
from pathlib import Path

import msgspec
import pytest
from distributed import Client, Security
from farm.config import Credentials
from farm.lab import cluster_io as cluster
from farm.lab.plan import PROGRAMS
from farm.security.access import Role
from farm.security.authority_io import SiteAuthority
from farm.security.certificates import DAYS
from farm.security.invitation_io import Invitation, write_private
from farm.security.lab_authority_io import LabAuthority
from farm.security.membership_io import CERTIFICATE, join, member_folder
from harness.machines.lab_project import DEADLINE_S, STEADY, WORDS, Lab
from harness.processes import Process, free_port, wait_until
from scara_bringup.processes.ports_io import listeners, sockets

HOST = "127.0.0.1"
NOW = datetime.now(timezone.utc)
PAST = NOW - timedelta(days=DAYS + 2)
PATIENCE_S = 2.0
READS = "print(sys.argv[1:], hash(tuple(pathlib.Path(sys.argv[1]).read_bytes()[-2_000_000:])))\n"
WRITES = """
bag = pathlib.Path(sys.argv[1])
(bag.parent / "report.json").write_bytes(bag.read_bytes()[::-1])
print(f"report: {bag.resolve().parent.as_uri()}/report.html", bag.parent.name)
print(bag, file=sys.stderr)
"""
NAMES = "print(*sorted(file.name for file in pathlib.Path(sys.argv[1]).parent.iterdir()))\n"


@dataclass
class Two:
    """The desk of a lab and another machine, each with a project and keys of its own."""

    desk: Lab
    other: Lab
    port: int

    @property
    def address(self) -> str:
        """Of the scheduler."""
        return f"tls://{HOST}:{self.port}"

    @property
    def authority(self) -> LabAuthority:
        """Of the lab."""
        return LabAuthority(self.desk.folder / "keys" / "lab", "site", NOW)

    def invite(self) -> None:
        """Let the other machine join the lab."""
        file = self.desk.folder / "pc_2.invitation"
        where = ("--address", f"{HOST}:{self.port}", "--file", str(file))
        self.desk.farm("invite", "pc_2", "--lab", *where)
        self.other.farm("join", str(file))

    def scheduler(self) -> Process:
        """Keep a scheduler at the desk."""
        kept = self.desk.start("scheduler", "--port", str(self.port), "--listen", HOST)
        wait_until(lambda: "use it:" in kept.output, DEADLINE_S, "the scheduler")
        return kept

    def asks(self, name: str, lab: Lab | None = None) -> tuple[int, str]:
        """Let a machine ask for jobs, the desk unless another is named."""
        lab = lab or self.desk
        return lab.say(*WORDS, "--folder", str(lab.folder / name), "--scheduler", self.address)

    def program(self, kind: str, text: str) -> None:
        """Let the program of a kind of jobs be these lines on both machines."""
        for lab in (self.desk, self.other):
            file = lab.folder.joinpath("devel", "lib", *PROGRAMS[kind])
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(f"#!{sys.executable}\nimport pathlib, sys\n{text}")
            file.chmod(0o755)


@pytest.fixture(scope="module")
def two(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Two]:
    """Give all tests one lab with one worker on the other machine."""
    folder = tmp_path_factory.mktemp("lab")
    made = Two(Lab(folder / "desk"), Lab(folder / "other"), free_port())
    for lab in (made.desk, made.other):
        lab.judge(STEADY)
        (lab.folder / "src").mkdir()
        (lab.folder / "src" / "one.py").write_text("a = 1\n")
    made.desk.work_here()
    made.invite()
    made.scheduler()
    working = made.other.start("worker", made.address, "--workers", "1")
    wait_until(lambda: "1 workers at" in working.output, DEADLINE_S, "the worker")
    yield made
    made.other.stage.close()
    made.desk.stage.close()


@pytest.fixture
def hurried(monkeypatch: pytest.MonkeyPatch) -> None:
    """Give up early where nobody is let in."""
    monkeypatch.setattr(cluster, "PATIENCE_S", PATIENCE_S)


@pytest.mark.thorough
def test_another_machine_gives_the_same_results_bit_for_bit(two: Two) -> None:
    """Points by their words; recordings by their content, though they are at the desk alone."""
    two.program("replay", READS)
    two.program("report", WRITES)
    bags = [two.desk.folder / "runs" / name / "run.bag" for name in ("a", "b b", "c")]
    for number, bag in enumerate(bags):
        bag.parent.mkdir(parents=True)
        bag.write_bytes(bytes([number]) * 5_000_000 if number < 2 else b"")
    jobs = {"points": WORDS, "replays": ("replay", *map(str, bags))}
    jobs["reports"] = ("report", *map(str, bags))
    for name, words in jobs.items():
        here = two.desk.run(f"{name}_here", words=words)
        reports = [bag.parent / "report.json" for bag in bags]
        kept = {file: file.read_bytes() for file in reports if file.exists()}
        for file in kept:
            file.unlink()
        far = two.desk.run(f"{name}_far", "--scheduler", two.address, words=words)
        assert far == here and here.count(b"\n") == len(two.desk.said(f"{name}_here"))
        assert {file: file.read_bytes() for file in reports if file.exists()} == kept
    assert len(kept) == 3


def test_all_parts_of_a_recording_are_one_job_and_go_with_it(two: Two) -> None:
    """Also where a link names the run once more; without the first part the next one is a job."""
    two.program("replay", NAMES)
    folder = two.desk.folder / "long"
    for file in (folder / "a" / "run.bag", *(folder / name / "run.part0002.bag" for name in "ab")):
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_bytes(b"bag")
    (folder / "latest").symlink_to("a")
    for name, more in (("parts_here", ()), ("parts_far", ("--scheduler", two.address))):
        two.desk.run(name, *more, words=("replay", f"{folder}/*"))
        assert two.desk.said(name) == ["run.bag run.part0002.bag\n", "run.part0002.bag\n"]


def test_a_worker_that_is_killed_there_loses_nothing(two: Two) -> None:
    """The first job to come kills its worker with SIGKILL."""
    here = two.desk.run("killed_here")
    mark = two.other.folder / "mark"
    two.other.judge(
        "try:\n"
        f"    pathlib.Path({str(mark)!r}).touch(exist_ok=False)\n"
        "    os.kill(os.getppid(), signal.SIGKILL)\n"
        "    time.sleep(100.0)\n"
        f"except FileExistsError:\n    {STEADY}\n"
    )
    assert two.desk.run("killed_far", "--scheduler", two.address) == here
    assert mark.exists()


def test_another_version_of_the_project_does_no_jobs(two: Two) -> None:
    """Neither when the worker's was changed since it has joined, nor when the lab's is another."""
    for lab, who in ((two.other, "worker tls://"), (two.desk, "the workers")):
        file = lab.folder / "src" / "one.py"
        file.write_text("a = 2\n")
        code, text = two.asks(f"changed_{lab.folder.name}")
        assert code == 1 and who in text and "results could differ" in text
        file.write_text("a = 1\n")
    assert two.asks("same")[0] == 0


def files_of(invitation: Invitation, folder: Path) -> Credentials:
    """Write what somebody shows."""
    for name in ("authority", "certificate", "key"):
        write_private(folder / name, getattr(invitation, name).encode())
    return Credentials(*(str(folder / name) for name in ("authority", "certificate", "key")))


def heard(port: int, files: Credentials | None, *, tls: bool = True) -> int:
    """Return how many bytes somebody is sent who connects; dask greets whom it lets in."""
    with socket.create_connection((HOST, port), PATIENCE_S) as plain:
        plain.settimeout(DEADLINE_S)
        try:
            if not tls:
                plain.sendall(b"\0" * 64)
                return len(plain.recv(100))
            context = ssl.create_default_context()
            context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
            if files is not None:
                context.load_cert_chain(files.certificate, files.key)
            with context.wrap_socket(plain) as line:
                return len(line.recv(100))
        except (ssl.SSLError, ConnectionError):
            return 0


def test_strangers_hear_nothing_at_any_port(two: Two, tmp_path: Path) -> None:
    """No TLS, no certificate, foreign, ended, of the farm; and nothing listens beyond loopback."""
    where, lab = (HOST, 1), two.desk.folder / "keys" / "lab"
    member = files_of(two.authority.invite("pc_6", Role.LAB, where), tmp_path / "good")
    ends = {"client": member, "scheduler": member, "worker": member}
    good = Security(
        tls_ca_file=member.authority,
        require_encryption=True,
        **{f"tls_{end}_cert": files.certificate for end, files in ends.items()},
        **{f"tls_{end}_key": files.key for end, files in ends.items()},
    )
    with Client(two.address, security=good, timeout=DEADLINE_S) as client:
        ((address, worker),) = client.scheduler_info()["workers"].items()
    found = {"scheduler": two.address, "worker": address, "nanny": worker["nanny"]}
    ports = {name: int(each.rsplit(":", 1)[1]) for name, each in found.items()}
    foreign = LabAuthority(tmp_path / "foreign", "site", NOW)
    farm = SiteAuthority(two.desk.folder / "keys" / "authority", "site", NOW)
    invited = {
        "of another lab": foreign.invite("pc_2", Role.LAB, where),
        "ended": LabAuthority(lab, "site", PAST).invite("old", Role.LAB, where),
        "of the farm": farm.invite("pc_2", Role.MACHINE, where),
        "a desk of the farm": farm.invite("laptop", Role.DESK, where),
    }
    strangers = {who: files_of(each, tmp_path / who) for who, each in invited.items()}
    strangers |= {"another lab's desk": foreign.desk(), "no certificate": None}
    got = {(who, at): heard(p, c) for who, c in strangers.items() for at, p in ports.items()}
    got |= {("no TLS", at): heard(port, None, tls=False) for at, port in ports.items()}
    assert len(got) == 21 and {key: count for key, count in got.items() if count} == {}
    assert all(heard(port, two.authority.desk()) for port in ports.values())
    inodes = {listener.inode: listener for listener in listeners()}
    ours = {
        int(line.split()[0])
        for stage in (two.desk.stage, two.other.stage)
        for line in stage.left_over()
    }
    seen = [inodes[i] for pid, _, held in sockets() if pid in ours for i in held & set(inodes)]
    assert len(seen) >= len(ports) and all(each.is_loopback for each in seen)


@pytest.mark.usefixtures("hurried")
def test_a_machine_of_another_lab_is_not_let_in(two: Two, tmp_path: Path) -> None:
    """By dask's own lines, neither to ask nor to work; and it is told where to look."""
    stranger = Lab(tmp_path / "stranger")
    foreign = LabAuthority(tmp_path / "foreign", "site", NOW)
    file = tmp_path / "foreign.invitation"
    made = foreign.invite("pc_2", Role.LAB, (HOST, two.port))
    write_private(file, msgspec.json.encode(made))
    stranger.farm("join", str(file))
    for code, text in (two.asks("a", stranger), stranger.say("worker", two.address)):
        assert code == 1 and "does not let this machine in" in text


@pytest.mark.parametrize("case", ["ended", "foreign", "broken", "missing"])
def test_a_certificate_that_is_no_good_is_named(tmp_path: Path, case: str) -> None:
    """With its file, before anybody is asked; who is in no lab is told how to join one."""
    lab, file = Lab(tmp_path / "lab"), tmp_path / "pc_2.invitation"
    words = ("worker", f"tls://{HOST}:1")
    code, text = lab.say(*words)
    assert code == 1 and "./cell farm invite NAME --lab" in text
    then = PAST if case == "ended" else NOW
    made, other = (
        LabAuthority(tmp_path / name, "site", then).invite("pc_2", Role.LAB, (HOST, 1))
        for name in ("a", "b")
    )
    write_private(file, msgspec.json.encode(made))
    keys = lab.folder / "keys"
    join(keys, file, then)
    shown = member_folder(keys, lab=True) / CERTIFICATE
    why = {
        "ended": "the certificate is good from",
        "foreign": "the certificate is not of the authority beside it",
        "broken": "the certificate cannot be read",
        "missing": "No such file",
    }[case]
    if case == "foreign":
        shown.write_text(other.certificate)
    elif case == "broken":
        shown.write_text("-----BEGIN CERTIFICATE-----")
    elif case == "missing":
        shown.unlink()
    code, text = lab.say(*words)
    assert code == 1 and f"{shown}: {why}" in text


@pytest.mark.thorough
@pytest.mark.usefixtures("hurried")
def test_a_member_that_is_revoked_is_out(two: Two, monkeypatch: pytest.MonkeyPatch) -> None:
    """The scheduler ends with all its lines; by the old invitation nobody comes in again."""
    (kept,) = (process for process in two.desk.stage.processes if "--listen" in process.command)
    folder = two.desk.folder / "renewed"
    two.authority.invite("pc_6", Role.LAB, (HOST, two.port))
    text = two.desk.farm("revoke", "pc_2", "--lab", "--folder", str(folder))
    assert "pc_2 is revoked" in text
    assert [file.name for file in folder.iterdir()] == ["pc_6.lab.invitation"]
    assert kept.wait(DEADLINE_S) == 1 and "has a new authority" in kept.output
    wait_until(lambda: not two.other.stage.left_over(), DEADLINE_S, "the worker's end")
    two.scheduler()
    assert "does not let this machine in" in two.asks("revoked", two.other)[1]
    monkeypatch.undo()  # who is let in is waited for
    two.invite()
    assert "has no workers" in two.asks("invited", two.other)[1]
