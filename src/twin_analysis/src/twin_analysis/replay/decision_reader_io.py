"""Read from a bag what a replay of the twin controller's core needs.

These are inputs, decisions and configuration.
"""

from __future__ import annotations

import json
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from cell_recorder.reading.bag_reader_io import Bag, BagError
from scara_config import ConfigError, load_robot
from twin_controller.config import load_twin_controller
from twin_controller.core.setup import Setup
from twin_experiments.report.run_reader_io import CONFIGURATION, DECISIONS

from twin_analysis.replay.decisions import RecordedDecision, RecordedInput

INPUTS = "twin_controller/inputs"
NEEDED_FILES = ("robot.yaml", "twin_controller.yaml")


def read_inputs(bag: Bag) -> Iterator[RecordedInput]:
    """Yield the recorded inputs in the order in which they were judged.

    Raises:
        BagError: There are none, or they were recorded without states.
    """
    bag.require([INPUTS])
    for at, message in bag.messages(INPUTS):
        if not hasattr(message, "state"):
            raise BagError(
                f"{bag.path}: {INPUTS} holds no states: recorded by an older version, "
                "which cannot be replayed"
            )
        data, state = message.data.tobytes(), message.state.tobytes()
        yield RecordedInput(
            at - bag.start, _nanoseconds(message), message.seq, data, state, message.header.frame_id
        )


def read_decisions(bag: Bag) -> dict[tuple[int, int], RecordedDecision]:
    """Return the recorded decisions by stamp [ns] and number."""
    found = {}
    for _, message in bag.messages(DECISIONS):
        # Older messages say nothing of who it was.
        names = RecordedDecision.__struct_fields__
        fields: dict[str, Any] = {name: getattr(message, name, None) for name in names}
        fields["actions"] = tuple(message.actions)
        found[_nanoseconds(message), message.seq] = RecordedDecision(**fields)
    return found


def read_setups(bag: Bag) -> Callable[[float], Setup]:
    """Return what gives profile and numbers in force at a time [s] of the recording.

    Raises:
        BagError: The bag holds no configuration, or not all of it.
        ConfigError: A recorded file is not understood.
    """
    bag.require([CONFIGURATION])
    texts: list[tuple[float, str]] = []
    for at, message in bag.messages(CONFIGURATION):
        texts.append((at - bag.start, message.data))
    built: dict[str, Setup] = {}

    def setup_at(at: float) -> Setup:
        # What came later than the first input was in force all the same: it was only not recorded
        # yet.
        text = next((text for begin, text in reversed(texts) if begin <= at), texts[0][1])
        if text not in built:
            built[text] = _build(bag, text)
        return built[text]

    return setup_at


def _build(bag: Bag, text: str) -> Setup:
    """Load the recorded files with the loaders of the controller itself."""
    try:
        files: Any = json.loads(text)
    except ValueError as error:
        raise BagError(f"{bag.path}: {CONFIGURATION} is no JSON: {error}") from error
    missing = [
        name
        for name in NEEDED_FILES
        if not isinstance(files, dict) or not isinstance(files.get(name), str)
    ]
    if missing:
        raise BagError(f"{bag.path}: {CONFIGURATION} lacks {', '.join(missing)}")
    with tempfile.TemporaryDirectory(prefix="recorded_") as folder:
        for name in NEEDED_FILES:
            (Path(folder) / name).write_text(files[name], encoding="utf-8")
        try:
            robot = load_robot(folder)
            return Setup(robot, load_twin_controller(robot, folder))
        except ConfigError as error:
            # The folder is gone by the time somebody reads this.
            raise ConfigError(str(error).replace(f"{folder}/", "in the bag: ")) from error


def _nanoseconds(message: Any) -> int:
    """Return the stamp of a message [ns]."""
    return int(message.header.stamp.sec) * 1_000_000_000 + int(message.header.stamp.nanosec)
