"""Edges and pulses of the user operator panel's inputs, as they are allocated."""

import msgspec
import pytest
from fanuc_emulator.uop import (
    INPUTS,
    MODE_KEYS,
    NORMALLY_ON,
    PANEL,
    UI,
    UO,
    Inputs,
    UopRequest,
    UopSettings,
    unlit,
    with_panel,
)
from harness.followed import FOLLOW_MAP
from scara_config.modbus_map import load_modbus_map

READY = UopSettings(
    cstopi_for_abort=True,
    imstp_assigned=True,
    uop="full",
    start_for_continue=True,
    shortest_pulse_ms=100,
)
RISING = {
    "cstopi": UopRequest.CYCLE_STOP,
    "panel_start": UopRequest.RESUME,
    "panel_abort": UopRequest.END,
    "panel_reset": UopRequest.RESET,
    **{f"rsr{n}": UopRequest.QUEUE for n in range(1, 9)},
    **{f"panel_run{n}": UopRequest.RUN for n in range(1, 9)},
    **dict.fromkeys(MODE_KEYS, UopRequest.TURN),
}
LONG = {"pnstrobe": UopRequest.SELECT}
FALLING = {
    "imstp": UopRequest.POWER_OFF,
    "panel_imstp": UopRequest.POWER_OFF,
    "hold": UopRequest.HOLD,
    "panel_hold": UopRequest.HOLD,
    "enbl": UopRequest.HOLD,
    "sfspd": UopRequest.HOLD,
    "fault_reset": UopRequest.RESET,
}
LONG_FALLING = {"start": UopRequest.START, "prod_start": UopRequest.START_FIRST}
SIMPLE = {
    "hold": {"hold"},
    "cstopi": {"cstopi", "fault_reset"},
    "fault_reset": {"cstopi", "fault_reset"},
    "start": {"start", "pnstrobe"},
    "pnstrobe": {"start", "pnstrobe"},
    "enbl": {"enbl"},
    **{f"rsr{n}": {f"rsr{n}"} for n in range(1, 5)},
}
"""The maker's table of the simple allocation: what each signal of ours reaches."""


def requests(asked: list[tuple[UopRequest, int]]) -> list[UopRequest]:
    """Return what is asked for without its numbers."""
    return [request for request, _ in asked]


def expected(*found: UopRequest | None) -> list[UopRequest]:
    """Return those that are there."""
    return [request for request in found if request is not None]


@pytest.mark.parametrize("name", INPUTS)
def test_each_input_acts_on_its_edge_and_on_no_other(name: str) -> None:
    """FAULT_RESET, START falling; CSTOPI, RSR rising; PNSTROBE once it is long; a level never."""
    inputs = Inputs(READY)
    assert inputs[name] is (name in NORMALLY_ON)
    inputs.write(name, False, 0)
    assert requests(inputs.write(name, True, 0)) == expected(RISING.get(name))
    assert inputs.write(name, True, 50) == []
    assert inputs.due(99) == []
    assert requests(inputs.due(100)) == expected(LONG.get(name))
    assert inputs.due(101) == []
    assert requests(inputs.write(name, False, 102)) == expected(
        FALLING.get(name), LONG_FALLING.get(name)
    )
    assert inputs.write(name, False, 103) == []


@pytest.mark.parametrize("name", [*LONG, *LONG_FALLING])
def test_a_pulse_that_is_too_short_is_not_seen(name: str) -> None:
    """99 ms ask for nothing, and the next pulse counts from its own beginning."""
    inputs = Inputs(READY)
    inputs.write(name, True, 1000)
    assert inputs.write(name, False, 1099) == [] == inputs.due(2000)
    inputs.write(name, True, 3000)
    late = inputs.due(3100) + inputs.write(name, False, 3100)
    assert requests(late) == expected(LONG.get(name), LONG_FALLING.get(name))


def test_requests_carry_the_number_of_their_program() -> None:
    """RSR3 and the pendant's key for program 4."""
    inputs = Inputs(READY)
    assert inputs.write("rsr3", True, 0) == [(UopRequest.QUEUE, 3)]
    assert inputs.write("panel_run4", True, 0) == [(UopRequest.RUN, 4)]


def test_a_numbered_command_is_a_pulse_that_is_long_enough() -> None:
    """A background program of the robot's own makes it."""
    inputs = Inputs(READY)
    assert requests(inputs.pulse("rsr2", 0)) == [UopRequest.QUEUE]
    assert requests(inputs.pulse("start", 0)) == [UopRequest.START]
    assert requests(inputs.pulse("fault_reset", 0)) == [UopRequest.RESET]


@pytest.mark.parametrize("name", UI)
@pytest.mark.parametrize("uop", ["none", "simple", "full"])
def test_an_input_without_allocation_has_no_effect(uop: str, name: str) -> None:
    """None: nothing acts. Simple: the maker's table; *IMSTP and *SFSPD are tied on."""
    inputs = Inputs(msgspec.structs.replace(READY, uop=uop))
    before = inputs.lit
    inputs.write(name, name not in NORMALLY_ON, 0)
    reached = {"none": set(), "simple": SIMPLE.get(name, set()), "full": {name}}[uop]
    assert before ^ inputs.lit == reached


@pytest.mark.parametrize("uop", ["none", "simple", "full"])
@pytest.mark.parametrize("name", PANEL)
def test_no_setting_touches_the_buttons_at_the_robot(uop: str, name: str) -> None:
    """A person at the robot uses no UOP."""
    inputs = Inputs(msgspec.structs.replace(READY, uop=uop, imstp_assigned=False))
    assert inputs.write(name, name not in NORMALLY_ON, 0)


def test_imstp_without_an_input_is_always_on() -> None:
    """The coil may be written, and nothing happens."""
    inputs = Inputs(msgspec.structs.replace(READY, imstp_assigned=False))
    assert inputs.write("imstp", False, 0) == []
    assert inputs["imstp"]


def test_simple_reset_is_cstopi_too() -> None:
    """One signal: it rises as CSTOPI and falls as RESET."""
    inputs = Inputs(msgspec.structs.replace(READY, uop="simple"))
    for name in ("cstopi", "fault_reset"):
        assert requests(inputs.write(name, True, 0)) == [UopRequest.CYCLE_STOP]
        assert requests(inputs.write(name, False, 30)) == [UopRequest.RESET]


def test_simple_start_selects_by_pns_and_starts() -> None:
    """It rises as PNSTROBE, which reads PNS1 to PNS4 as a number, and falls as START."""
    inputs = Inputs(msgspec.structs.replace(READY, uop="simple"))
    for name in ("rsr1", "rsr3"):
        assert inputs.write(name, True, 0) == []
    inputs.write("start", True, 0)
    assert inputs.due(100) == [(UopRequest.SELECT, 5)]
    assert inputs.write("start", False, 120) == [(UopRequest.START, 0)]


def test_outputs_without_allocation_are_those_of_the_makers_table() -> None:
    """Simple leaves UO 1, 6, 9 and 10; none leaves nothing."""
    assert unlit("full") == ()
    assert unlit("none") == UO
    assert [UO.index(name) + 1 for name in UO if name not in unlit("simple")] == [1, 6, 9, 10]


def test_a_map_without_keys_gets_those_of_the_stand_in() -> None:
    """They stand where the shipped map has them, and the override can be written."""
    shipped, made = load_modbus_map(), with_panel(FOLLOW_MAP)
    assert not FOLLOW_MAP.coils.keys() & PANEL
    for name in (name for name in PANEL if name not in MODE_KEYS):
        bit, wanted = made.coils[name], shipped.coils[name]
        assert (bit.address, bit.normal) == (wanted.address, wanted.normal)
        assert (bit.pulse_ms, bit.write) == (wanted.pulse_ms, wanted.write)
    override = made.holding_registers["override"]
    assert override.write and override.address == made.holding_registers["override_now"].address


def test_names_and_levels_at_rest_are_those_of_the_map() -> None:
    """modbus_map.yaml and the controller agree on all 18 inputs and the keys at the robot."""
    coils = {name: bit for name, bit in load_modbus_map().coils.items() if name != "gripper"}
    mapped = tuple(name for name in INPUTS if name not in MODE_KEYS)
    assert tuple(sorted(coils, key=lambda name: coils[name].address)) == mapped
    assert tuple(name for name in mapped if coils[name].normal) == NORMALLY_ON
