"""What changed and why it is quicker, and the proof; in words."""

from __future__ import annotations

from collections.abc import Sequence

import msgspec

from what_if.improving.plants import PlantRun
from what_if.physics import Simulated
from what_if.uncertainty.chances import Chances
from what_if.verdict import Outcome, Verdict


class Change(msgspec.Struct, frozen=True):
    """One change.

    Attributes:
        what: In words.
        was: As written.
        now: As it is.
        saves: The program would take so much longer without this change alone [s].
    """

    what: str
    was: str
    now: str
    saves: float


class Proof(msgspec.Struct, frozen=True):
    """What speaks for a program.

    Attributes:
        plants: What each plant of the stand-in does with the old program and with the new one;
            None: it does not end.
        before: Verdict on the old program.
        after: On the new one.
        jerks_percent: Largest jerk of a joint in percent of robot.yaml, old and new.
        physics: In the simulated world; None: there are no parts.
        worlds: In worlds that differ; None: in none.
        tolerance_mm: So near to its place each part has to lie.
    """

    plants: dict[str, tuple[PlantRun | None, PlantRun | None]]
    before: Verdict
    after: Verdict
    jerks_percent: tuple[float, float]
    physics: Simulated | None
    worlds: Chances | None
    tolerance_mm: float

    @property
    def fault(self) -> str:
        """Why it is none; empty: it is."""
        if self.after.outcome is Outcome.REFUSED:
            return self.after.sentence
        for plant, (one, two) in self.plants.items():
            if one is None or two is None:
                return f"{plant}: the program does not come to its end"
            if two.seconds >= one.seconds:
                return f"{plant}: it takes {two.seconds:.2f} s, before {one.seconds:.2f} s"
            if two.collisions or two.drops:
                return f"{plant}: {two.collisions} collisions, {two.drops} parts dropped"
            if sorted(two.placed) != sorted(one.placed):
                return f"{plant}: {len(two.placed)} of {len(one.placed)} parts placed"
            if two.off_mm > max(self.tolerance_mm, one.off_mm):
                return f"{plant}: a part lies {two.off_mm:.2f} mm from its place"
        if self.physics is not None and self.physics.outcome is Outcome.REFUSED:
            return f"in the simulated world: {self.physics.sentence}"
        if self.worlds is not None and self.worlds.refused > 0.0:
            # A part that drops, or a zone that is come too near to, counts as much as a hit.
            why = self.worlds.likeliest or ", ".join(self.worlds.causes)
            return f"{100.0 * self.worlds.refused:.0f} % of the worlds: {why}"
        return ""


def change_lines(changes: Sequence[Change]) -> list[str]:
    """Return the table of changes."""
    rows = [("what changed", "was", "is", "saves alone")]
    rows += [(each.what, each.was, each.now, f"{each.saves:.2f} s") for each in changes]
    widths = [max(len(row[k]) for row in rows) for k in range(3)]
    return [
        "  ".join([*(cell.ljust(width) for cell, width in zip(row, widths)), f"{row[3]:>11}"])
        for row in rows
    ]


def proof_lines(proof: Proof) -> list[str]:
    """Return the proof in words."""
    lines = []
    for plant, (one, two) in proof.plants.items():
        if one is None or two is None:
            continue
        share = 100.0 * (1.0 - two.seconds / one.seconds)
        lines.append(
            f"{plant:<10} {one.seconds:.2f} s -> {two.seconds:.2f} s, {share:.1f} % quicker"
        )
        if one.placed:
            lines.append(
                f"           {len(two.placed)} of {len(one.placed)} parts placed, "
                f"{two.off_mm:.2f} mm off at most, {two.drops} dropped, {two.collisions} collisions"
            )
    efforts = (
        max(verdict.joints, key=lambda use: use.effort_percent)
        for verdict in (proof.before, proof.after)
    )
    shown = " -> ".join(f"{use.effort_percent:.0f} % ({use.joint})" for use in efforts)
    lines.append(f"effort     {shown} of robot.yaml at most")
    old, new = proof.jerks_percent
    lines.append(f"jerk       {old:.0f} % -> {new:.0f} % of robot.yaml at most, behind the filters")
    for name, verdict in (("before", proof.before), ("now", proof.after)):
        near = verdict.clearance
        if near is not None:
            one_, other = near.between
            lines.append(f"clearance  {name}: {near.distance_mm:.1f} mm between {one_} and {other}")
    lines.append(f"zones      {', '.join(proof.after.zones) or 'none touched'}")
    if proof.physics is not None:
        lines.append(f"physics    {proof.physics.sentence}")
    if proof.worlds is not None:
        hits = round(proof.worlds.collision * proof.worlds.worlds)
        lines.append(
            f"worlds     {hits} collisions in {proof.worlds.worlds} that differ "
            f"(seed {proof.worlds.seed}), {proof.worlds.duration_low_s:.2f} to "
            f"{proof.worlds.duration_high_s:.2f} s"
        )
    return lines
