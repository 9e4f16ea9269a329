"""Names that keep two cells at one master apart, and those of parts and programs in messages.

A cell is a namespace of ROS. Its frames carry the namespace in front, since ``/tf`` is one topic
for all cells; and of ``/diagnostics`` and ``/tf`` it takes what its own nodes send.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Any

import msgspec

ROOT = "/"
SHARED_TOPICS = ("/diagnostics", "/tf", "/tf_static")
"""All cells at a master publish there; who wants one cell asks who has sent a message."""
STREAM = "stream"
"""In ``control_type`` of scara_msgs/RobotData: the twin controller's set points move the robot."""
_PROGRAM = re.compile(r"(?P<name>\S+) line (?P<line>\d+) (?P<state>\w+)")
_NAMESPACE = re.compile(r"[A-Za-z]\w*(?:/[A-Za-z]\w*)*", re.ASCII)


class Seat(msgspec.Struct, frozen=True):
    """A person, and the page or client at which they are; empty for nobody."""

    person: str = ""
    session: str = ""

    @property
    def name(self) -> str:
        """What people are told."""
        return f"{self.person} {self.session}".strip()


class NamespaceError(ValueError):
    """A namespace that ROS does not allow; the text says which and what is allowed."""


def namespace_of(text: str) -> str:
    """Return a namespace in its one absolute form, as rospy and the master see it.

    Args:
        text: As ROS_NAMESPACE may hold it: with or without slashes around it; empty: none.

    Raises:
        NamespaceError: It has characters that a ROS name may not have.

    Example:
        >>> [namespace_of(text) for text in ("", "/", "cell_2", "/cell_2", " cell_2/ ")]
        ['/', '/', '/cell_2', '/cell_2', '/cell_2']
    """
    inner = text.strip().strip("/")
    if inner and not _NAMESPACE.fullmatch(inner):
        raise NamespaceError(
            f"ROS_NAMESPACE = {text!r}: allowed are letters, digits and _, a letter first, "
            "for example cell_2 or hall/cell_2"
        )
    return f"/{inner}"


def resolve(name: str, namespace: str) -> str:
    """Make a relative ROS name absolute.

    Example:
        >>> resolve("move_to", "/cell_2"), resolve("move_to", "cell_2/"), resolve("/tf", "/cell_2")
        ('/cell_2/move_to', '/cell_2/move_to', '/tf')
    """
    return name if name.startswith("/") else f"{namespace_of(namespace).rstrip('/')}/{name}"


def frame_in(frame: str, namespace: str) -> str:
    """Return a tf frame of the cell in ``namespace``; the cell without one has plain frames.

    Example:
        >>> frame_in("base_link", "/"), frame_in("real/tool0", "cell_2")
        ('base_link', 'cell_2/real/tool0')
    """
    return resolve(frame, namespace)[1:]


def cell_of(namespace: str) -> str:
    """Return what people call the cell in a namespace.

    Example:
        >>> cell_of("/"), cell_of("/milk_2"), cell_of("hall/cell_2")
        ('cell', 'milk_2', 'hall/cell_2')
    """
    return namespace_of(namespace)[1:] or "cell"


def folder_of(stamp: str, namespace: str) -> str:
    """Return the name of a folder that a cell makes at a time: two cells never make the same.

    Example:
        >>> folder_of("2026-05-01_12-00-00", "/"), folder_of("2026-05-01_12-00-00", "hall/cell_2")
        ('2026-05-01_12-00-00', '2026-05-01_12-00-00_hall_cell_2')
    """
    return "_".join([stamp, *filter(None, namespace_of(namespace).split("/"))])


def is_remote(caller: str, remote: Iterable[str]) -> bool:
    """Return whether a node asks for somebody else: one of ``remote``, or below it.

    A name that no node can have is that of a client: gateway and farm call in its name.

    Args:
        caller: Its absolute name, as ``callerid`` of a connection says it; without one nobody
            knows who it is.
        remote: Words of which none may stand in the name.

    Example:
        >>> is_remote("/cell_2/gateway/operator@10.0.0.7", ["gateway"]), is_remote("/farm/a@b", [])
        (True, True)
        >>> is_remote("/rosservice", ["gateway"]), is_remote("", ["gateway"])
        (False, True)
    """
    return not caller or "@" in caller or not set(remote).isdisjoint(caller.split("/"))


def is_of_cell(node: str, namespace: str) -> bool:
    """Return whether a node belongs to the cell in ``namespace``.

    A node in a namespace below one belongs to it too. Below the root it does not: that is where the
    other cells are.

    Args:
        node: Its absolute name, as ``callerid`` of a connection says it; empty counts as ours,
            because nothing says otherwise.
        namespace: Of the cell.

    Example:
        >>> is_of_cell("/cell_2/gateway", "/cell_2"), is_of_cell("/cell_2/gateway", "/")
        (True, False)
    """
    base = namespace_of(namespace)
    if not node:
        return True
    return node.count("/") < 2 if base == ROOT else node.startswith(f"{base}/")


def part_name(marker: Any) -> str:
    """Return the name of the part that a visualization_msgs/Marker shows.

    It is the marker's namespace: RViz lists those, and warns of a text on anything but a text.
    Older recordings have it as the text.
    """
    name: str = marker.text or marker.ns
    return name


def current_line(said: str) -> tuple[str, int]:
    """Return program and line that run or are paused now; an empty name if none does.

    Args:
        said: As ``program`` of scara_msgs/RobotData says it.

    Example:
        >>> current_line("ARTICLE line 5 paused"), current_line("ARTICLE line 9 aborted")
        (('ARTICLE', 5), ('', 0))
    """
    found = _PROGRAM.fullmatch(said)
    if found is None or found["state"] not in ("running", "paused", "held"):
        return "", 0
    return found["name"], int(found["line"])


def own_program(control_type: str, program: str, running: bool) -> tuple[str, bool]:
    """Return the real robot's program and whether it runs, of scara_msgs/RobotData.

    That which streams set points to the robot is none of its own: an empty name, and not running.
    """
    return ("", False) if control_type == STREAM else (program, running)
