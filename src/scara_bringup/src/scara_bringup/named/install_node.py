"""``cell install``: write or remove the service unit of a cell, and say what to do next."""

from __future__ import annotations

import getpass
import os
from collections.abc import Sequence
from pathlib import Path

from scara_config.profile import CHOICE, PLANT_CHOICE, plant_path
from scara_ros.names import NamespaceError
from scara_ros.shell.program_io import FAILED, WRONG, workspace

from scara_bringup.named.naming import namespace_by_name
from scara_bringup.named.service_file_io import (
    MACHINE,
    InstallError,
    personal_units,
    remove_unit,
    write_unit,
)
from scara_bringup.named.service_unit import Service
from scara_bringup.terminal import screen_io as screen


def install_cell(
    name: str, options: Sequence[str], machine: bool, folder: Path | None, remove: bool
) -> int:
    """Write a cell's unit, or remove it; return the exit code.

    Args:
        name: Of the cell.
        options: Further options of ``./cell up``.
        machine: Whether it is a unit of the machine.
        folder: Where it goes; None: systemd's own place.
        remove: Whether it is removed.
    """
    try:
        namespace_by_name(name)
        # Refuse a robot or plant that is not there now, rather than at each start
        for option, choice in (("--robot", CHOICE), ("--plant", PLANT_CHOICE)):
            if option in options:
                os.environ[choice] = options[list(options).index(option) + 1]
        plant_path()
    except (NamespaceError, ValueError) as error:
        screen.complain(str(error))
        return WRONG
    root = workspace().resolve()
    # Under sudo it is the cell of the person who has called it.
    caller = os.environ.get("SUDO_USER") if os.geteuid() == 0 else ""
    user = (caller or getpass.getuser()) if machine else ""
    service = Service(name, root, tuple(options), user)
    place = folder or (MACHINE if machine else personal_units())
    try:
        path = (remove_unit if remove else write_unit)(service, place)
    except InstallError as error:
        screen.complain(str(error))
        return FAILED
    systemctl = "systemctl" if machine else "systemctl --user"
    if remove:
        print(f"cell: removed {path}; if it was enabled: {systemctl} daemon-reload")
        return 0
    print(f"cell: wrote {path}. Nothing was enabled. Next:")
    print(f"  {systemctl} daemon-reload && {systemctl} enable --now {service.file}")
    if not machine:
        print("  loginctl enable-linger    # it starts with the machine, not with your session")
    return 0
