"""Reads a recording and writes its lines: the work of ``rosrun operator_panel retell``."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from cell_recorder.reading.bag_reader_io import Bag, BagError, open_bag
from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError

from operator_panel.retelling.lines import Line
from operator_panel.retelling.retelling import NEWEST, TOPICS, Retelling

CONFIGURATION, ROBOT = "twin_controller/configuration", "robot.yaml"


def lines_of(path: Path, silent_s: float) -> Iterator[Line]:
    """Yield what a page shows of a bag with its further parts, in the order of time.

    Args:
        path: The bag, or the first of its parts.
        silent_s: From when on the twin controller counts as silent [s].

    Raises:
        BagError: It cannot be read, or holds nothing that a page shows.
    """
    with open_bag(path) as bag:
        bag.require(["twin_controller/state"])
        retelling = Retelling(bag.start, bag.end, silent_s)
        yield retelling.head(_robot(bag))
        # Of what comes all the time only the newest before a moment is read.
        waiting: dict[str, tuple[float, Callable[[], Any]]] = {}
        for at, topic, read in bag.merged(TOPICS):
            while (moment := retelling.due(at)) is not None:
                yield from _moment(retelling, moment, waiting)
            if topic in NEWEST:
                waiting[topic] = at, read
            else:
                retelling.take(topic, at, read())
        yield from _moment(retelling, bag.end, waiting)


def _moment(
    retelling: Retelling, at: float, waiting: dict[str, tuple[float, Callable[[], Any]]]
) -> Iterator[Line]:
    """Read what waits, then tell of the moment."""
    for topic, (received, read) in waiting.items():
        retelling.take(topic, received, read())
    waiting.clear()
    yield from retelling.lines(at)


def _robot(bag: Bag) -> str:
    """Return the name of the recorded robot; empty if the bag does not hold it."""
    for _, message in bag.messages(CONFIGURATION):
        try:
            found = YAML(typ="safe", pure=True).load(json.loads(message.data).get(ROBOT, ""))
        except (ValueError, AttributeError, YAMLError) as error:
            raise BagError(f"{bag.path}: its configuration is not understood: {error}") from error
        return str(found["name"]) if isinstance(found, dict) and "name" in found else ""
    return ""
