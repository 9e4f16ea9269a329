"""Which payload the twin's controller is told, and which truly hangs at the tool. Pure."""

from __future__ import annotations

from collections.abc import Sequence

from scara_config.palletise import MM, Palletise
from scara_config.payload import Payload, PayloadError, Payloads


class PayloadDesk:
    """The table of payloads, and the two that are in force.

    Attributes:
        table: payloads.yaml, with what was changed since.
        told: What the controller was told.
        mounted: What hangs at the simulated tool.
    """

    def __init__(self, table: Payloads) -> None:
        """Begin with what the file says."""
        self.table = table
        self.told, self.mounted = table.find(table.set_number), table.find(table.mounted_number)

    def judge(
        self, number: int, values: Payload | None, moving: Sequence[str]
    ) -> tuple[Payloads, Payload]:
        """Return the table and the payload that a request leads to; nothing is changed yet.

        Args:
            number: Of the entry.
            values: What the entry shall be; None: as it is.
            moving: Joints that do not stand still.

        Raises:
            PayloadError: There is no such entry, the robot cannot carry it, or a joint moves: the
                efforts would jump.
        """
        table = self.table if values is None else self.table.replaced(values)
        payload = table.find(number)
        if moving:
            verb = "moves" if len(moving) == 1 else "move"
            raise PayloadError(
                f"{', '.join(moving)} {verb}: a payload is changed only at standstill: STOP first"
            )
        return table, payload


def part_payload(work: Palletise) -> Payload:
    """Return a part of the work as it hangs at the nozzle: an upright disc below it."""
    kind = work.parts
    across = kind.mass_kg * (kind.radius**2 / 4.0 + kind.height**2 / 12.0)
    about = kind.mass_kg * kind.radius**2 / 2.0
    below = work.task.gap_mm * MM + 0.5 * kind.height
    return Payload(1, "part", kind.mass_kg, (0.0, 0.0, below), (across, across, about))


def same_body(one: Payload, other: Payload) -> bool:
    """Tell whether two payloads weigh and move alike, whatever they are called."""
    bodies = [(p.mass_kg, p.centre_m, p.inertia_kg_m2) for p in (one, other)]
    # Where there is no mass, its centre means nothing.
    return bodies[0] == bodies[1] or one.mass_kg == other.mass_kg == 0.0


def described(payload: Payload) -> str:
    """Return a payload in words."""
    x, y, z = (1e3 * value for value in payload.centre_m)
    return (
        f"PAYLOAD[{payload.number}] {payload.name}: {payload.mass_kg:g} kg, centre "
        f"{x:g} {y:g} {z:g} mm"
    )
