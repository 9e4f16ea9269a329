"""The file with the first week of a robot's cycles; it is whole or as it was."""

from __future__ import annotations

import logging
from pathlib import Path

import msgspec
from scara_config.files.whole_file import write_whole

from twin_analysis.health.live.weeks import Weeks

# Below rosout: it reaches the cell's log, and this module needs no rospy.
_LOG = logging.getLogger("rosout.health_weeks")


def read_weeks(file: Path) -> Weeks:
    """Return what is kept; a file that cannot be read is put aside, and the week begins anew.

    Raises:
        OSError: It cannot be opened, or not be put aside.
    """
    try:
        return msgspec.json.decode(file.read_bytes(), type=Weeks)
    except FileNotFoundError:
        return Weeks()
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        aside = file.with_suffix(".unreadable")
        file.replace(aside)
        _LOG.warning("%s: %s; kept as %s, the first week begins anew", file, error, aside.name)
        return Weeks()


def write_weeks(file: Path, weeks: Weeks) -> None:
    """Write what is kept.

    Raises:
        OSError: It cannot be written.
    """
    file.parent.mkdir(parents=True, exist_ok=True)
    write_whole(file, msgspec.json.encode(weeks))
