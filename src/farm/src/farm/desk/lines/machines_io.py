"""``./cell farm invite | join | leave | revoke | certificates``: other machines come in."""

from __future__ import annotations

import os
from datetime import datetime, timezone
from pathlib import Path
from typing import Annotated

import msgspec
import typer
from scara_ros.shell.program_io import WRONG

from farm import keys
from farm.config import PORT, ReachedError, reached
from farm.desk.command_line_io import app, configured, fail, print_table
from farm.lab.address import PORT as LAB_PORT
from farm.security.access import Role
from farm.security.authority_io import SOON, SiteAuthority, authority_folder
from farm.security.invitation_io import Invitation, SecurityError, keys_folder, write_private
from farm.security.lab_authority_io import LabAuthority, has_lab, lab_authority_folder
from farm.security.membership_io import join as keep
from farm.security.membership_io import leave as forget

OfLab = Annotated[bool, typer.Option("--lab", help="Of the lab, not of the farm.")]
Renewed = Annotated[
    Path, typer.Option(help="For new invitations; NAME.invitation, NAME.lab.invitation.")
]
Who = Annotated[str, typer.Argument(help="A machine's name, or a desk's.")]


def opened_authority(*, lab: bool = False) -> SiteAuthority:
    """Return this site's authority, of the farm or of the lab.

    Raises:
        SecurityError: Its files cannot be used.
    """
    site, now, own = configured(None).site, datetime.now(timezone.utc), keys_folder(os.environ)
    if lab:
        return LabAuthority(lab_authority_folder(own), site, now)
    return SiteAuthority(authority_folder(own), site, now)


@app.command()
def invite(
    name: Who,
    desk: Annotated[bool, typer.Option("--desk", help="Another desk: it asks all cells.")] = False,
    lab: Annotated[
        bool,
        typer.Option("--lab", help="Into the lab: it runs any program on all machines there."),
    ] = False,
    address: Annotated[
        str, typer.Option(help="Where this desk is reached, HOST[:PORT]. Default: as last time.")
    ] = "",
    file: Annotated[Path | None, typer.Option(help="Default: NAME.invitation.")] = None,
) -> None:
    """Make the file by which a machine joins; it holds a private key: hand it over safely."""
    keys.checked("site", name, "cell")
    where = reached(address, LAB_PORT if lab else PORT) if address else None
    if desk and lab:
        fail("--desk and --lab are two invitations: make one after the other", WRONG)
    target = (file or Path(f"{name}.invitation")).resolve()
    role = Role.LAB if lab else Role.MACHINE
    role = Role.DESK if desk else role
    made = opened_authority(lab=lab).invite(name, role, where)
    write_private(target, msgspec.json.encode(made))
    typer.echo(f"{target}: lets {role.value} {name} in at {made.host}:{made.port} for 90 days.")
    here = f"a desk that runs with --listen {made.host} lets it in within 2 seconds."
    if made.role is Role.LAB:
        here = f"./cell lab scheduler --listen {made.host}"
    typer.echo(f"There: ./cell farm join {target.name}. Here: {here}")
    typer.echo("Whoever has the file can come in as this machine: remove it once it was used.")
    if lab:
        typer.echo("It can then run any program on the machines of the lab, this one too.")


@app.command()
def join(file: Annotated[Path, typer.Argument(help="The invitation.")]) -> None:
    """Let this machine's cells, or this desk, join the farm or the lab of another machine."""
    kept = keep(keys_folder(os.environ), file, datetime.now(timezone.utc))
    who = f"{kept.role.value} {kept.name}"
    typer.echo(f"joined site {kept.site} as {who}; desk: {kept.host}:{kept.port}")
    following = "./cell up --farm"
    if kept.role is Role.LAB:
        following = f"./cell lab worker tls://{kept.host}:{kept.port}"
    typer.echo(f"Next: {following}. Remove the invitation now.")


@app.command()
def leave(lab: OfLab = False) -> None:
    """Forget the farm of another machine, or its lab."""
    was = forget(keys_folder(os.environ), lab=lab)
    if lab:
        typer.echo("left the lab" if was else "nothing was joined")
        return
    typer.echo("left: cells join the desk of this machine again" if was else "nothing was joined")


@app.command()
def revoke(name: Who, lab: OfLab = False, folder: Renewed = Path("renewed")) -> None:
    """Let nobody in by a certificate of this name; a desk that runs puts it out within 2 s.

    The lab gets another authority for that, and everybody else there a new invitation.
    """
    opened_authority(lab=lab).revoke(name)
    if not lab:
        typer.echo(f"{name} is revoked. A desk that runs puts it out within 2 seconds.")
        return
    try:
        count = _renewed(lab, "", folder)
    except SecurityError as error:
        fail(f"{error}. {name} is still let in: do it again", WRONG)
    typer.echo(f"{name} is revoked: the lab's keys are new. A scheduler that runs ends by itself.")
    typer.echo(f"{count} new invitations for the others in {folder.resolve()}, to join again by.")
    typer.echo("Then start scheduler and workers anew.")


@app.command()
def renew(
    everything: Annotated[
        bool, typer.Option("--all", help="Both authorities, and all certificates of both.")
    ] = False,
    address: Annotated[
        str, typer.Option(help="Where this desk is reached, HOST[:PORT]. Default: as last time.")
    ] = "",
    folder: Renewed = Path("renewed"),
) -> None:
    """Begin anew with other keys: what was signed before opens nothing, stolen keys neither."""
    if not everything:
        fail("renew --all: all is made anew. For one machine alone: ./cell farm invite NAME", WRONG)
    try:
        count = _renewed(False, address, folder)
        if has_lab(keys_folder(os.environ)):
            count += _renewed(True, address, folder)
    except (ReachedError, SecurityError) as error:
        fail(f"{error}. Not all is renewed: do it again", WRONG)
    typer.echo(f"All keys are new; {count} new invitations in {folder.resolve()}.")
    typer.echo("Nothing of before counts. There: ./cell farm join NAME.invitation, then remove it.")
    typer.echo("A desk that runs takes the new keys within 2 seconds. The lab's scheduler ends by")
    typer.echo("itself: start it and its workers anew.")


def _renewed(lab: bool, address: str, folder: Path) -> int:
    """Begin an authority anew; return how many are invited again.

    Raises:
        ReachedError: The address is none.
        SecurityError: A file cannot be written, or nobody knows where the desk is.
    """
    where = reached(address, LAB_PORT if lab else PORT) if address else None
    ending = ".lab.invitation" if lab else ".invitation"

    def keep_in(made: Invitation) -> None:
        write_private(folder.resolve() / f"{made.name}{ending}", msgspec.json.encode(made))

    return len(opened_authority(lab=lab).renew(where, keep_in))


@app.command()
def certificates() -> None:
    """List who was invited, and for how long."""
    authorities = [opened_authority()]
    if has_lab(keys_folder(os.environ)):
        authorities.append(opened_authority(lab=True))
    now = datetime.now(timezone.utc)
    rows = []
    for each in (one for authority in authorities for one in authority.register.invited):
        left = (datetime.fromtimestamp(each.until, timezone.utc) - now).days
        state = "good"
        if each.revoked is not None:
            state = "revoked"
        elif left < 0:
            state = "ended"
        elif left < SOON.days:
            state = "ends soon: invite it again"
        rows.append((each.name, each.role.value, each.number, max(left, 0), state))
    print_table(("name", "role", "invitation", "days left", "state"), rows)
    typer.echo(f"{len(rows)} invited, {sum(len(a.good()) for a in authorities)} may come in")
