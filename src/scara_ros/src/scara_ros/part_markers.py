"""How parts are shown: a marker each, whose namespace is the part's name.

RViz warns of a text on anything but a text, and lists markers by their namespaces.
"""

from __future__ import annotations

from typing import Any


def part_name(marker: Any) -> str:
    """Return the name of the part that a visualization_msgs/Marker shows.

    Older recordings have it as the text.
    """
    name: str = marker.text or marker.ns
    return name
