"""Decide by a judgement whether a motion may begin, and what is said of it."""

from __future__ import annotations

from dataclasses import dataclass

from scara_ros.gate.settings import Act, GateSettings, Unjudged

SOURCES = {
    "limit": "range of the joint: robot.yaml",
    "reach": "reach of the arm: robot.yaml",
    "zone": "zones: keep_out in robot.yaml",
    "collision": "bodies: the robot's URDF, and what stands in the cell",
    "drop": "stands and pallet: palletise.yaml",
    "grip": "stands and parts: palletise.yaml",
}
"""Where somebody finds what stands against a motion, by the judge's word for it."""


@dataclass(frozen=True)
class Judgement:
    """What the judge has said.

    Attributes:
        refused: The motion must not be made.
        sentence: The verdict in one sentence, with the reason and its time.
        cause: The judge's word for the reason; empty without one.
        place_mm: Where it happens, in the base frame [mm]; None if it has no place.
    """

    refused: bool
    sentence: str
    cause: str = ""
    place_mm: tuple[float, float, float] | None = None

    @property
    def text(self) -> str:
        """The sentence with its place, and where to look."""
        text = self.sentence
        if self.place_mm is not None:
            text += " near ({:.0f}, {:.0f}, {:.0f}) mm".format(*self.place_mm)
        source = SOURCES.get(self.cause, "")
        return f"{text} ({source})" if source else text


@dataclass(frozen=True)
class Permit:
    """May a motion begin?

    Attributes:
        allowed: Whether it may.
        text: Why not, or what has been found; shown and kept.
        note: What whoever asked for the motion is told beside the answer; empty: nothing.
    """

    allowed: bool
    text: str
    note: str = ""


def permit(settings: GateSettings, judgement: Judgement) -> Permit:
    """Return what follows from a judgement."""
    text = judgement.text
    if not judgement.refused:
        return Permit(True, text)
    if settings.gate is Act.REFUSE:
        return Permit(False, text)
    warned = f"moved all the same (gate: {settings.gate}): {text}"
    return Permit(True, warned, warned)


def unjudged(settings: GateSettings, why: str) -> Permit:
    """Return what follows if there is no judgement.

    Args:
        settings: The gate.
        why: There is none.
    """
    if settings.gate is Act.REFUSE and settings.gate_without_judge is Unjudged.REFUSE:
        return Permit(False, f"not judged, and so refused (gate_without_judge: refuse): {why}")
    return Permit(True, f"not judged: {why}")


SWITCHED_OFF = Permit(True, "not judged (gate: off)")
