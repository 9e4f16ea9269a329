"""Judge palletising.

It says which parts lie on their places, how far off, how long it took, and what was hit or dropped.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from scara_config.palletise import MM, Palletise

from scara_msgs.msg import PartEvent

SIDES = ("real", "twin")
HEIGHT_MM = 1.0
"""A part that lies higher or lower than the pallet by more [mm] lies not on it. Our choice."""


@dataclass(frozen=True)
class Handled:
    """What one side recorded of its parts.

    Args:
        places: Time [s] and where each part's middle was, x y z [m], in order.
        events: Time [s], kind, part and text of each scara_msgs/PartEvent.
    """

    places: Sequence[tuple[float, Mapping[str, tuple[float, float, float]]]] = ()
    events: Sequence[tuple[float, str, str, str]] = ()


@dataclass(frozen=True)
class SideOutcome:
    """What one side has achieved.

    Args:
        side: ``real`` or ``twin``.
        errors_mm: Distance of each part from its place; of a part that is not on the pallet
            infinite.
        placed: Parts within the tolerance.
        cycle_s: From the start of the experiment until the last part was placed; None: none was.
        collisions: Texts of all collisions.
        drops: Texts of all drops.
    """

    side: str
    errors_mm: Mapping[str, float]
    placed: tuple[str, ...]
    cycle_s: float | None
    collisions: tuple[str, ...] = ()
    drops: tuple[str, ...] = ()
    parts: int = field(default=0)

    @property
    def error_max_mm(self) -> float | None:
        """Largest error of the parts that lie on the pallet."""
        found = [error for error in self.errors_mm.values() if math.isfinite(error)]
        return max(found) if found else None


def outcome(side: str, handled: Handled, work: Palletise, start: float, end: float) -> SideOutcome:
    """Judge one side.

    Args:
        side: ``real`` or ``twin``.
        handled: What was recorded.
        work: Parts and places; part k belongs on place k.
        start: When the experiment began [s].
        end: When it ended [s]; what was last known by then counts.
    """
    last: Mapping[str, tuple[float, float, float]] = {}
    for at, places in handled.places:
        # What was told later may belong to another experiment.
        if at <= end:
            last = places
    level = work.pallet.top_mm * MM + 0.5 * work.parts.height
    errors = {}
    for part, place in zip(work.starts(), work.pallet.places()):
        middle = last.get(part.name)
        errors[part.name] = math.inf  # it does not lie on the pallet
        if middle is not None and abs(middle[2] - level) <= HEIGHT_MM * MM:
            errors[part.name] = math.dist(middle[:2], place) / MM
    events = [event for event in handled.events if start <= event[0] <= end]
    placed_at = [at for at, kind, _, _ in events if kind == PartEvent.PLACED]
    return SideOutcome(
        side,
        errors,
        tuple(name for name, error in errors.items() if error <= work.task.tolerance_mm),
        placed_at[-1] - start if placed_at else None,
        tuple(text for _, kind, _, text in events if kind == PartEvent.COLLISION),
        tuple(text for _, kind, _, text in events if kind == PartEvent.DROPPED),
        len(errors),
    )


def shortcomings(outcomes: Sequence[SideOutcome], tolerance_mm: float) -> tuple[str, ...]:
    """Return every reason why palletising failed; none: it passed."""
    reasons = []
    for found in outcomes:
        if len(found.placed) < found.parts:
            missing = ", ".join(name for name in found.errors_mm if name not in found.placed)
            reasons.append(
                f"{found.side}: {len(found.placed)} of {found.parts} parts within "
                f"{tolerance_mm:g} mm; not {missing}"
            )
        for what, texts in (("collision", found.collisions), ("drop", found.drops)):
            if texts:
                reasons.append(
                    f"{found.side}: {len(texts)} {what}{'s' if len(texts) > 1 else ''}, "
                    f"the first: {texts[0]}"
                )
    return tuple(reasons)


def as_document(outcomes: Sequence[SideOutcome]) -> dict[str, object]:
    """Return the section ``parts`` of an experiment in report.json.

    An error of None: the part is not on the pallet.
    """
    return {
        found.side: {
            "placed": len(found.placed),
            "of": found.parts,
            "error_max_mm": found.error_max_mm,
            "errors_mm": {
                name: error if math.isfinite(error) else None
                for name, error in found.errors_mm.items()
            },
            "cycle_time_s": found.cycle_s,
            "collisions": list(found.collisions),
            "drops": list(found.drops),
        }
        for found in outcomes
    }


SUMMARY = ("side", "placed", "error max", "cycle time", "collisions", "drops")


def summary_rows(outcomes: Sequence[SideOutcome]) -> list[tuple[str, ...]]:
    """Return one row of text for each side, cells as in ``SUMMARY``."""
    return [
        (
            found.side,
            f"{len(found.placed)} / {found.parts}",
            "-" if found.error_max_mm is None else f"{found.error_max_mm:.3f} mm",
            "-" if found.cycle_s is None else f"{found.cycle_s:.1f} s",
            str(len(found.collisions)),
            str(len(found.drops)),
        )
        for found in outcomes
    ]


def error_rows(outcomes: Sequence[SideOutcome]) -> list[tuple[str, ...]]:
    """Return one row of text for each part: its name and its error on each side [mm]."""
    rows = []
    for name in outcomes[0].errors_mm if outcomes else ():
        errors = [found.errors_mm[name] for found in outcomes]
        shown = [f"{mm:.3f}" if math.isfinite(mm) else "not on the pallet" for mm in errors]
        rows.append((name, *shown))
    return rows
