"""Names of the ROS graph, as a client writes them."""

from __future__ import annotations

import re

_LEGAL = re.compile(r"/?[A-Za-z]\w*(?:/[A-Za-z0-9_]+)*", re.ASCII)


class NameNotLegalError(ValueError):
    """A name that ROS does not allow."""


def resolve(name: str, namespace: str) -> str:
    """Return ``name`` as an absolute name; without a leading slash it stands in ``namespace``.

    Raises:
        NameNotLegalError: Empty, private, or with characters that ROS does not allow.

    Example:
        >>> resolve("twin/joint_states", "/cell_2")
        '/cell_2/twin/joint_states'
        >>> resolve("/clock", "/cell_2")
        '/clock'
    """
    if not _LEGAL.fullmatch(name):
        raise NameNotLegalError(f"{name[:80]!r} is no legal ROS name")
    return name if name.startswith("/") else f"{namespace.rstrip('/')}/{name}"
