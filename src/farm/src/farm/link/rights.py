"""Who may do what from the farm, beyond STOP and PAUSE, which need no right."""

from __future__ import annotations

from collections.abc import Iterator

import msgspec
from scara_config.quantities import RightsWord

ALWAYS = ("STOP", "PAUSE")
"""Neither role nor switch nor revision is asked for."""
GUARDED = ("RESUME", "RESET", "HOME", "ALIGN", "ESTOP", "ACKNOWLEDGE", "SPEED")
"""Taken from the farm if role, switch and revision allow it. No targets: those are for the cell."""
CONFIGURING = ("EXAMINE", "CONFIGURE", "TAKE_BACK")
"""About the configuration of the cell's next start; based on the number of its changes."""
ASKABLE = GUARDED + CONFIGURING


class Rights(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Section ``rights`` of farm.yaml."""

    default_role: RightsWord
    roles: dict[RightsWord, list[RightsWord]]
    persons: dict[RightsWord, RightsWord]

    def faults(self) -> Iterator[tuple[str, str, str]]:
        """Yield (key, value, what is allowed) of everything that fits nothing."""
        known = ", ".join(self.roles)
        named = {f"persons.{person}": role for person, role in self.persons.items()}
        for key, role in {"default_role": self.default_role, **named}.items():
            if role not in self.roles:
                yield key, role, f"allowed are the roles {known}"
        for role, commands in self.roles.items():
            for command in commands:
                if command not in ASKABLE:
                    yield f"roles.{role}", command, f"allowed are {', '.join(ASKABLE)}"

    def role(self, person: str) -> str:
        """Return the role of a person."""
        return self.persons.get(person, self.default_role)

    def allows(self, person: str, command: str) -> bool:
        """Return whether a person may give a command."""
        return command in ALWAYS or command in self.roles[self.role(person)]
