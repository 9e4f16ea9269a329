"""What the doctor finds: one thing, what to do about it, and in which files."""

from __future__ import annotations

from collections.abc import Iterable
from enum import Enum

import msgspec


class Group(Enum):
    """The four groups of the article's section 6, and what else a cell reads."""

    ROBOT = "the robot"
    SIMULATION = "the simulation"
    REGISTERS = "the registers"
    LINKS = "the links"
    FILES = "the other files"


class Level(Enum):
    """How bad it is."""

    FINE = "ok"
    NOTE = "note"
    WRONG = "WRONG"


class Finding(msgspec.Struct, frozen=True):
    """One result of one check.

    Attributes:
        group: Where it belongs.
        level: How bad it is.
        what: What was found, with values.
        advice: What to do; empty if nothing.
        at: The file and the keys in it, ``robot.yaml joints.joint_1.lower_deg``; empty: ``what``
            begins with them.
    """

    group: Group
    level: Level
    what: str
    advice: str = ""
    at: str = ""


def fine(group: Group, what: str) -> Finding:
    """Return that something is as it should be."""
    return Finding(group, Level.FINE, what)


def note(group: Group, what: str, advice: str) -> Finding:
    """Return something that is to be looked at and may be right."""
    return Finding(group, Level.NOTE, what, advice)


def wrong(group: Group, what: str, advice: str, at: str = "") -> Finding:
    """Return something that cannot be right."""
    return Finding(group, Level.WRONG, what, advice, at)


def or_fine(found: Iterable[Finding], group: Group, what: str) -> list[Finding]:
    """Return the findings, or that all is fine if none is there."""
    return list(found) or [fine(group, what)]


def is_healthy(findings: Iterable[Finding]) -> bool:
    """Return whether nothing is wrong."""
    return all(finding.level is not Level.WRONG for finding in findings)


class Places(msgspec.Struct, frozen=True):
    """Paths of a robot's files.

    Attributes:
        robot: robot.yaml.
        programs: The folder of its programs.
        urdf: Its URDF.
        body: body.yaml, from which the URDF is written; empty: a person writes the URDF.
    """

    robot: str
    programs: str
    urdf: str
    body: str = ""

    def agree(self, name: str) -> str:
        """Return what makes robot.yaml and URDF say the same.

        Args:
            name: Of the robot.
        """
        if not self.body:
            return f"take the data sheet's value into {self.robot} and {self.urdf}"
        return f"take the data sheet's value into {self.robot}, then: {write_urdf(name)}"


def write_urdf(name: str) -> str:
    """Return the command that writes a robot's URDF from robot.yaml and body.yaml."""
    return f"rosrun scara_description write_urdf {name}"
