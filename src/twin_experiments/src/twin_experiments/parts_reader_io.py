"""Parts and their events of both sides, from a bag; and the work they belong to."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from cell_recorder.reading.bag_reader_io import Bag
from scara_config import ConfigError, convert
from scara_config.files.yaml_text import YamlTextError, parse
from scara_config.palletise import FILE, Palletise, find_palletise
from scara_ros.names import part_name

from twin_experiments.palletising import SIDES, Handled


def read_handled(bag: Bag) -> dict[str, Handled]:
    """Return what each side recorded of its parts, times [s] since the start of the recording.

    Sides without are left out.
    """
    found = {}
    for side in SIDES:
        places, events = f"{side}/parts", f"{side}/part_events"
        if bag.count(places):
            rows = []
            for at, message in bag.messages(places):
                # Where the middle of each part was [m].
                points = {part_name(marker): marker.pose.position for marker in message.markers}
                middles = {name: (p.x, p.y, p.z) for name, p in points.items()}
                rows.append((at - bag.start, middles))
            found[side] = Handled(
                rows,
                [
                    (at - bag.start, message.kind, message.part, message.message)
                    for at, message in bag.messages(events)
                ],
            )
    return found


def read_work(recorded: Mapping[str, Any], directory: Path | None) -> Palletise | None:
    """Return the work that was in force: from the recorded files, else from ``directory``.

    None if there was none.

    Raises:
        ConfigError: The file is wrong.
    """
    text = recorded.get(FILE)
    if text is None:
        # A bag that holds files, and this one not, is of a cell without parts.
        return None if recorded else find_palletise(directory)
    try:
        tree = parse(text)
    except (YamlTextError, TypeError, AttributeError) as error:
        raise ConfigError(f"{FILE} in the bag: is no valid YAML: {error}") from error
    return convert(tree, Palletise, f"{FILE} in the bag")
