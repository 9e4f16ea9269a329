"""``./cell farm invite | join | leave | revoke | certificates``: other machines come in."""

from __future__ import annotations

import os
from datetime import datetime, timezone
from pathlib import Path
from typing import Annotated

import msgspec
import typer

from farm import keys
from farm.desk.io.command_line import WRONG, app, configured, fail, print_table
from farm.security.access import Role
from farm.security.io.authority import SOON, Authority, authority_folder
from farm.security.io.invitation import SecurityError, keys_folder, write_private
from farm.security.io.membership import join as keep
from farm.security.io.membership import leave as forget

PORT = 7448
"""Where the desk listens for other machines unless another port is given; zenoh's usual one is
taken on loopback."""
Who = Annotated[str, typer.Argument(help="A machine's name, or a desk's.")]


class ReachedError(ValueError):
    """A text is no HOST[:PORT]; it says so."""


def reached(text: str) -> tuple[str, int]:
    """Return host and port of ``HOST[:PORT]``.

    Raises:
        ReachedError: It is no such thing, or an address at which nobody is reached.

    Example:
        >>> reached("hall-pc"), reached("10.0.0.5:8000"), reached("[fd00::1]:8000")
        (('hall-pc', 7448), ('10.0.0.5', 8000), ('fd00::1', 8000))
    """
    host, colon, port = text.rpartition(":")
    if not colon or text.endswith("]"):
        host, port = text, str(PORT)
    host = host.removeprefix("[").removesuffix("]")
    if not host or not port.isdigit() or not 1 <= int(port) <= 65535:
        raise ReachedError(f"{text}: give HOST or HOST:PORT, [HOST]:PORT for IPv6")
    if host in ("0.0.0.0", "::", "*"):
        raise ReachedError(
            f"{text}: give the name or address at which other machines reach this one"
        )
    return host, int(port)


def opened_authority() -> Authority:
    """Return this site's authority, or end with a text."""
    try:
        folder = authority_folder(keys_folder(os.environ))
        return Authority(folder, configured(None).site, datetime.now(timezone.utc))
    except SecurityError as error:
        fail(str(error), WRONG)


@app.command()
def invite(
    name: Who,
    desk: Annotated[bool, typer.Option("--desk", help="Another desk: it asks all cells.")] = False,
    address: Annotated[
        str, typer.Option(help="Where this desk is reached, HOST[:PORT]. Default: as last time.")
    ] = "",
    file: Annotated[Path | None, typer.Option(help="Default: NAME.invitation.")] = None,
) -> None:
    """Make the file by which a machine joins; it holds a private key: hand it over safely."""
    try:
        keys.checked("site", name, "cell")
        where = reached(address) if address else None
    except (keys.CellNameError, ReachedError) as error:
        fail(str(error), WRONG)
    target = (file or Path(f"{name}.invitation")).resolve()
    try:
        role = Role.DESK if desk else Role.MACHINE
        made = opened_authority().invite(name, role, where)
        write_private(target, msgspec.json.encode(made))
    except SecurityError as error:
        fail(str(error), WRONG)
    typer.echo(f"{target}: lets {role.value} {name} in at {made.host}:{made.port} for 90 days.")
    typer.echo(f"There: ./cell farm join {target.name}. Here: start the desk anew with --listen.")
    typer.echo("Whoever has the file can come in as this machine: remove it once it was used.")


@app.command()
def join(file: Annotated[Path, typer.Argument(help="The invitation.")]) -> None:
    """Let this machine's cells, or this desk, join the farm of another machine."""
    try:
        kept = keep(keys_folder(os.environ), file, datetime.now(timezone.utc))
    except SecurityError as error:
        fail(str(error), WRONG)
    who = f"{kept.role.value} {kept.name}"
    typer.echo(f"joined site {kept.site} as {who}; desk: {kept.host}:{kept.port}")
    typer.echo("Next: ./cell up --farm. Remove the invitation now.")


@app.command()
def leave() -> None:
    """Forget the farm of another machine."""
    try:
        was = forget(keys_folder(os.environ))
    except SecurityError as error:
        fail(str(error), WRONG)
    typer.echo("left: cells join the desk of this machine again" if was else "nothing was joined")


@app.command()
def revoke(name: Who) -> None:
    """Let nobody in by a certificate of this name, from the desk's next start on."""
    try:
        opened_authority().revoke(name)
    except SecurityError as error:
        fail(str(error), WRONG)
    typer.echo(f"{name} is revoked. A desk that runs now lets it in until it is started anew.")


@app.command()
def certificates() -> None:
    """List who was invited, and for how long."""
    authority = opened_authority()
    now = datetime.now(timezone.utc)
    rows = []
    for each in authority.register.invited:
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
    typer.echo(f"{len(rows)} invited, {len(authority.good())} may come in")
