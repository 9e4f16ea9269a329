"""Names of the ROS graph, as a client writes them."""

from __future__ import annotations

import re
from collections.abc import Iterable
from fnmatch import translate

_LONGEST = 255  # our choice: ROS itself knows no bound
_LEGAL = re.compile(r"/?[A-Za-z]\w*(?:/[A-Za-z0-9_]+)*", re.ASCII)


class NameNotLegalError(ValueError):
    """A name that ROS does not allow."""


def resolve(name: str, namespace: str) -> str:
    """Return ``name`` as an absolute name; without a leading slash it stands in ``namespace``.

    Raises:
        NameNotLegalError: Empty, private, too long, or with characters that ROS does not allow.

    Example:
        >>> resolve("twin/joint_states", "/cell_2")
        '/cell_2/twin/joint_states'
        >>> resolve("/clock", "/cell_2")
        '/clock'
    """
    if len(name) > _LONGEST or not _LEGAL.fullmatch(name):
        raise NameNotLegalError(f"{name[:80]!r} is no legal ROS name")
    return name if name.startswith("/") else f"{namespace.rstrip('/')}/{name}"


def patterns_in(patterns: Iterable[str], namespace: str) -> list[str]:
    """Return patterns of names; one without a leading slash stands in ``namespace``.

    Example:
        >>> patterns_in(["twin/*", "/rosapi/*"], "/cell_2")
        ['/cell_2/twin/*', '/rosapi/*']
    """
    base = namespace.rstrip("/")
    return [p if p.startswith("/") else f"{base}/{p}" for p in patterns]


def any_of(patterns: Iterable[str]) -> re.Pattern[str]:
    """Return one expression for many patterns: a publisher's name is judged with each message."""
    return re.compile("|".join(translate(p) for p in patterns) or r"(?!)")
