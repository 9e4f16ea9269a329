"""The controller's digital signals.

Inputs UI[1..18] as the client writes them, outputs UO[1..20] as it reads them.

Source:
    The real controller's user operator panel (UOP).
"""

from __future__ import annotations

from enum import Enum, auto

import msgspec


class Request(Enum):
    """What an edge of an input asks for."""

    NOTHING = auto()
    POWER_OFF = auto()
    HOLD = auto()
    END = auto()
    RESET = auto()
    RESUME = auto()
    RUN = auto()


INPUTS = (
    ("imstp", "hold", "sfspd", "cstopi", "fault_reset", "start", "home", "enbl")
    + tuple(f"rsr{number}" for number in range(1, 9))
    + ("pnstrobe", "prod_start", "panel_imstp", "panel_hold")
)
"""The last two are the buttons of the person at the robot; no client of the UOP releases them."""
NORMALLY_ON = ("imstp", "hold", "sfspd", "enbl", "panel_imstp", "panel_hold")

# (input, value after the edge) -> request. HOME, PNSTROBE and PROD_START do nothing here.
_EDGES: dict[tuple[str, bool], Request] = {
    ("imstp", False): Request.POWER_OFF,
    ("panel_imstp", False): Request.POWER_OFF,
    ("hold", False): Request.HOLD,
    ("panel_hold", False): Request.HOLD,
    ("enbl", False): Request.HOLD,
    ("cstopi", True): Request.END,
    ("fault_reset", False): Request.RESET,
    ("start", False): Request.RESUME,
    **{(f"rsr{number}", True): Request.RUN for number in range(1, 9)},
}


class Inputs:
    """Levels of all inputs; ``lit`` are those that are on."""

    def __init__(self) -> None:
        self._levels = {name: name in NORMALLY_ON for name in INPUTS}
        self.lit = frozenset(NORMALLY_ON)

    def __getitem__(self, name: str) -> bool:
        """Level of the input called ``name``."""
        return self._levels[name]

    def write(self, name: str, value: bool) -> Request:
        """Set an input and return what its edge asks for; a level that stays asks for nothing."""
        if self._levels[name] == value:
            return Request.NOTHING
        self._levels[name] = value
        self.lit = self.lit | {name} if value else self.lit - {name}
        return _EDGES.get((name, value), Request.NOTHING)


class Outputs(msgspec.Struct, frozen=True):
    """Levels of the outputs, named as in modbus_map.yaml.

    ``gripper`` is RO[1], ``vacuum`` its answer RI[1].
    """

    cmdenbl: bool
    sysrdy: bool
    progrun: bool
    paused: bool
    held: bool
    fault: bool
    atperch: bool
    tpenbl: bool
    batalm: bool
    busy: bool
    panel_estop: bool
    panel_held: bool
    gripper: bool = False
    vacuum: bool = False
