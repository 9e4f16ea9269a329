"""A change of a cell's configuration: which values of which files become what. Pure.

A change names values, never files to be written: what it does not name stays as the cell has it,
and nothing of it can lead out of the folder of the configuration.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterator, Mapping
from typing import Any, TypeAlias

import msgspec

from scara_config.writer import Key

Flat: TypeAlias = bool | int | float | str | None
Value: TypeAlias = Flat | list[Flat | list[Flat]]
"""Of a YAML file: one value, or a list, or a list of lists."""
NAME = r"^[A-Za-z0-9][A-Za-z0-9_.-]{0,62}\Z"
MOST_VALUES = 200
"""Our choice: a change that people can still read."""

ALL = ("",)
ALLOWED: Mapping[str, tuple[str, ...]] = {
    "pid_gains.yaml": ALL,
    "payloads.yaml": ALL,
    "palletise.yaml": ALL,
    "experiments.yaml": ALL,
    "comparison.yaml": ALL,
    "camera.yaml": ALL,
    "motion.yaml": (
        "move.default_speed_percent",
        "move.position_tolerance_deg",
        "move.position_tolerance_mm",
        "move.settle_timeout",
        "trim",
        "trajectory.path_tolerance_deg",
        "trajectory.path_tolerance_mm",
        "trajectory.goal_tolerance_deg",
        "trajectory.goal_tolerance_mm",
        "trajectory.goal_time_tolerance",
    ),
    "twin_controller.yaml": ("response", "shadow"),
    "what_if.yaml": ("uncertainty", "program"),
}
"""Files, and their sections or keys, that a change from elsewhere may touch. Left out is what
protects people and stops a robot, says who may do what, says where something listens or which
robot this is, and how fast a person's jog is: that is decided at the cell. Nothing is here of what
safety, orders, lead and change detection of the twin controller read: a contract test compares."""


class Change(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A change with a name.

    Attributes:
        name: For people.
        values: New values by file and by key with dots: ``{"motion.yaml": {"move.speed": 50.0}}``.
    """

    name: str
    values: dict[str, dict[str, Value]]

    @property
    def digest(self) -> str:
        """Tells two changes apart, whatever their names."""
        # Sorted: the order of keys makes no other change of it.
        plain = msgspec.json.encode(self.values, order="deterministic")
        return hashlib.sha256(plain).hexdigest()[:12]

    @property
    def text(self) -> str:
        """One line for people."""
        return f"{self.name} ({self.digest})"

    def by_file(self) -> dict[str, dict[Key, Any]]:
        """Return the values as :func:`scara_config.writer.changed_text` takes them."""
        return {
            file: {tuple(key.split(".")): value for key, value in values.items()}
            for file, values in self.values.items()
        }

    def faults(self) -> Iterator[str]:
        """Yield why it may not come from elsewhere; nothing: it may.

        Example:
            >>> list(Change("slow", {"persons.yaml": {"persons": "x"}}).faults())[0][:45]
            'persons.yaml: no change from elsewhere may to'
        """
        if not re.fullmatch(NAME, self.name):
            yield (
                f"name = {self.name[:63]!r}: allowed are 1 to 63 letters, digits, dots, dashes and "
                "underlines, a letter or digit first"
            )
        count = sum(map(len, self.values.values()))
        if not 0 < count <= MOST_VALUES:
            yield f"{count} values: allowed are 1 to {MOST_VALUES}"
        for file, values in self.values.items():
            sections = ALLOWED.get(file)
            if sections is None:
                yield (
                    f"{file[:63]}: no change from elsewhere may touch it; "
                    f"allowed are {', '.join(ALLOWED)}"
                )
                continue
            for key in values if sections != ALL else ():
                # With dots behind both: a section does not allow a key that only begins so.
                if not any(f"{key}.".startswith(f"{section}.") for section in sections):
                    yield (
                        f"{file}: {key[:63]}: is decided at the cell; a change from elsewhere may "
                        f"touch {', '.join(sections)}"
                    )


class ChangeError(ValueError):
    """A text that is no change; it says what is wrong."""


def change_of(tree: object) -> Change:
    """Return a change from a YAML or JSON tree.

    Raises:
        ChangeError: It is none, or may not come from elsewhere; a line for each fault.
    """
    try:
        change = msgspec.convert(tree, Change)
    except msgspec.ValidationError as error:
        raise ChangeError(str(error)) from error
    if faults := list(change.faults()):
        raise ChangeError("\n".join(faults))
    return change
