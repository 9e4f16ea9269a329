"""The controller's digital signals.

They are inputs UI[1..18] as the client writes them, outputs UO[1..20] as it reads them, the keys of
the pendant, and how an integrator set all that up.

Source:
    The maker's operator's manual B-83284EN/09, sections 3.3, 3.8 and 3.15: docs/sources.md.
"""

from __future__ import annotations

from enum import Enum, auto
from typing import Annotated, Literal

import msgspec
from msgspec import Meta
from scara_config.modbus_map import Bit, ModbusMap


class UopSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """What stands on the robot's screens System > Config and I/O > UOP.

    Attributes:
        cstopi_for_abort: CSTOPI ends the program at once. Else the program goes on to its end, and
            only the requests that wait are cleared.
        imstp_assigned: ``*IMSTP`` has an input of its own. Else it is always on.
        uop: Which signals are allocated: ``full``; ``simple``: few, and CSTOPI and RESET are one
            signal, START and PNSTROBE another; ``none``: no UI acts and no UO lights.
        start_for_continue: START only lets a paused program go on. Else it starts the selected
            program too, in the line where it stands.
        shortest_pulse_ms: START, PROD_START and PNSTROBE that are on for less are not seen. RSR is
            taken at its rising edge, whatever its length.
        enable_ui: Inputs UI count at all.
        unwired: Inputs UI to which nothing is wired: they are off until a client writes them.
    """

    cstopi_for_abort: bool
    imstp_assigned: bool
    uop: Literal["none", "simple", "full"]
    start_for_continue: bool
    shortest_pulse_ms: Annotated[int, Meta(ge=0, le=1000)]
    enable_ui: bool = True
    unwired: tuple[Literal["imstp", "hold", "sfspd", "enbl"], ...] = ()


class UopRequest(Enum):
    """What an edge of an input asks for; one that starts something comes with a number."""

    NOTHING = auto()
    POWER_OFF = auto()
    HOLD = auto()
    END = auto()
    CYCLE_STOP = auto()
    RESET = auto()
    RESUME = auto()
    START = auto()
    START_FIRST = auto()
    QUEUE = auto()
    SELECT = auto()
    RUN = auto()
    TURN = auto()


_RSR = tuple(f"rsr{number}" for number in range(1, 9))
_RUN = tuple(f"panel_run{number}" for number in range(1, 9))
UI = (
    ("imstp", "hold", "sfspd", "cstopi", "fault_reset", "start", "home", "enbl")
    + _RSR
    + ("pnstrobe", "prod_start")
)
"""UI[1..18], the user operator panel."""
MODE_KEYS = ("panel_auto", "panel_t1", "panel_t2")
"""Turn the mode switch; the digit of each is what it asks for."""
PANEL = ("panel_imstp", "panel_hold", "panel_start", "panel_abort", "panel_reset", *_RUN)
PANEL += MODE_KEYS
"""Buttons and keys of the person at the robot; no setting of the UOP touches them."""
INPUTS = UI + PANEL
NORMALLY_ON = ("imstp", "hold", "sfspd", "enbl", "panel_imstp", "panel_hold")

# (input, value after the edge) -> request. HOME does nothing here.
_EDGES: dict[tuple[str, bool], UopRequest] = {
    ("imstp", False): UopRequest.POWER_OFF,
    ("panel_imstp", False): UopRequest.POWER_OFF,
    ("hold", False): UopRequest.HOLD,
    ("panel_hold", False): UopRequest.HOLD,
    ("enbl", False): UopRequest.HOLD,
    ("sfspd", False): UopRequest.HOLD,
    ("cstopi", True): UopRequest.CYCLE_STOP,
    ("fault_reset", False): UopRequest.RESET,
    ("start", False): UopRequest.START,
    ("prod_start", False): UopRequest.START_FIRST,
    ("panel_start", True): UopRequest.RESUME,
    ("panel_abort", True): UopRequest.END,
    ("panel_reset", True): UopRequest.RESET,
    **{(name, True): UopRequest.QUEUE for name in _RSR},
    **{(name, True): UopRequest.RUN for name in _RUN},
    **{(name, True): UopRequest.TURN for name in MODE_KEYS},
}
# What counts when it goes off, if it has been on for long enough. PNSTROBE counts while it is on.
_OFF_AFTER_LONG_ENOUGH = ("start", "prod_start")

# "simple": one signal drives several inputs, and those that are left out have no input.
_PNS = _RSR[:4]
_SIMPLE: dict[str, tuple[str, ...]] = {
    "hold": ("hold",),
    "enbl": ("enbl",),
    "cstopi": ("cstopi", "fault_reset"),
    "fault_reset": ("cstopi", "fault_reset"),
    "start": ("pnstrobe", "start"),
    "pnstrobe": ("pnstrobe", "start"),
    **{name: (name,) for name in _PNS},
}
_LIT: dict[str, tuple[str, ...]] = {"none": (), "simple": ("cmdenbl", "fault", "batalm", "busy")}
"""The outputs that an allocation has; one that is not named here has all."""

Asked = tuple[UopRequest, int]


class Inputs:
    """Levels of all inputs as the robot sees them, and the pulses that are not over.

    Args:
        settings: Of the user operator panel.

    Attributes:
        lit: Those that are on.
    """

    def __init__(self, settings: UopSettings) -> None:
        self._settings = settings
        self._levels = {name: name in NORMALLY_ON for name in INPUTS}
        # When each input that counts by its length came on, by the robot's own clock [ms].
        self._since: dict[str, int] = {}
        # PNSTROBE is on, and has not been on for long enough yet.
        self._strobed = False
        self.lit = frozenset(NORMALLY_ON)

    def __getitem__(self, name: str) -> bool:
        """Level of the input called ``name``."""
        return self._levels[name]

    def write(self, name: str, value: bool, now_ms: int) -> list[Asked]:
        """Set a signal and return what the edges of its inputs ask for.

        A level that stays asks for nothing, a signal without an input neither.
        """
        return [asked for each in self._driven(name) for asked in self._set(each, value, now_ms)]

    def pulse(self, name: str, now_ms: int) -> list[Asked]:
        """Return what a pulse asks for that a program of the robot's own makes, long enough."""
        asked = self.write(name, True, now_ms)
        later = now_ms + self._settings.shortest_pulse_ms
        return asked + self.due(later) + self.write(name, False, later)

    def due(self, now_ms: int) -> list[Asked]:
        """Return what PNSTROBE asks for once it has been on for long enough."""
        if not self._strobed:
            return []
        if now_ms - self._since["pnstrobe"] < self._settings.shortest_pulse_ms:
            return []
        self._strobed = False
        return [self._asked("pnstrobe", UopRequest.SELECT)]

    def _driven(self, name: str) -> tuple[str, ...]:
        """Return the inputs that a signal drives, as they are allocated."""
        if name in PANEL:
            return (name,)
        settings = self._settings
        if settings.uop == "none" or not settings.enable_ui:
            return ()
        if name == "imstp" and not settings.imstp_assigned:
            return ()
        return _SIMPLE.get(name, ()) if self._settings.uop == "simple" else (name,)

    def _set(self, name: str, value: bool, now_ms: int) -> list[Asked]:
        if self._levels[name] == value:
            return []
        self._levels[name] = value
        self.lit = self.lit | {name} if value else self.lit - {name}
        if value:
            self._since[name] = now_ms
        if name == "pnstrobe":
            self._strobed = value
            return self.due(now_ms)
        asked = _EDGES.get((name, value))
        # With the simple allocation RSR is not there: these are bits of a program's number.
        if asked is None or (self._settings.uop == "simple" and name in _PNS):
            return []
        if name in _OFF_AFTER_LONG_ENOUGH:
            since = self._since.pop(name)
            if now_ms - since < self._settings.shortest_pulse_ms:
                return []
        return [self._asked(name, asked)]

    def _asked(self, name: str, request: UopRequest) -> Asked:
        """Return a request with the number that it is about; 0: none."""
        if request is UopRequest.SELECT:
            simple = self._settings.uop == "simple"
            bits = [self._levels[each] for each in _PNS] if simple else []
            return request, sum(1 << place for place, on in enumerate(bits) if on)
        digit = name[-1]
        return request, int(digit) if digit.isdigit() else 0


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


UO = Outputs.__struct_fields__[:10]
"""UO[1..10]."""


def unlit(uop: str) -> tuple[str, ...]:
    """Return the outputs UO that stay off because they are not allocated."""
    lit = _LIT.get(uop, UO)
    return tuple(name for name in UO if name not in lit)


_PANEL_LEVELS = {"panel_imstp": 6023, "panel_hold": 6024}
_PANEL_KEYS = {"panel_start": 6025, "panel_abort": 6026, "panel_reset": 6027} | {
    f"panel_run{number}": 6030 + number for number in range(1, 9)
}
"""Coils, as config/robots/fanuc_sr6ia/modbus_map.yaml has them."""
_PANEL_MODE = {name: 6028 + number for number, name in enumerate(MODE_KEYS)}
_KEY_PULSE_MS = 30


def with_panel(layout: ModbusMap) -> ModbusMap:
    """Return a map with the stand-in's own keys and override: a person presses them in any case.

    A map with numbered commands stays as it is, one with keys of its own gets the mode switch.
    """
    if layout.command_word is not None:
        return layout
    own = layout.has_panel
    coils = {
        name: Bit(address, normal=True, meaning="of the stand-in")
        for name, address in _PANEL_LEVELS.items()
        if not own
    } | {
        name: Bit(address, pulse_ms=_KEY_PULSE_MS, meaning="of the stand-in")
        for name, address in {
            **({} if own else _PANEL_KEYS),
            **(_PANEL_MODE if layout.shows_mode else {}),
        }.items()
    }
    held = layout.holding_registers
    override = msgspec.structs.replace(held["override_now"], write=True)
    return msgspec.structs.replace(
        layout,
        coils={**layout.coils, **coils},
        # Of two registers of one variable the last is written.
        holding_registers={**held, "override": held.get("override", override)},
    )
