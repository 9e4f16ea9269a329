"""Edges of the user operator panel's inputs."""

import pytest
from fanuc_emulator.uop import INPUTS, NORMALLY_ON, Inputs, Request
from scara_config.modbus_map import load_modbus_map

RISING = {"cstopi": Request.END, **{f"rsr{n}": Request.RUN for n in range(1, 9)}}
FALLING = {
    "imstp": Request.POWER_OFF,
    "panel_imstp": Request.POWER_OFF,
    "hold": Request.HOLD,
    "panel_hold": Request.HOLD,
    "enbl": Request.HOLD,
    "fault_reset": Request.RESET,
    "start": Request.RESUME,
}


@pytest.mark.parametrize("name", INPUTS)
def test_each_input_acts_on_its_edge_and_on_no_other(name: str) -> None:
    """FAULT_RESET and START act on the falling edge, RSR and CSTOPI on the rising one.

    A repeated level never.
    """
    inputs = Inputs()
    assert inputs[name] is (name in NORMALLY_ON)
    inputs.write(name, False)
    assert inputs.write(name, True) is RISING.get(name, Request.NOTHING)
    assert inputs.write(name, True) is Request.NOTHING
    assert inputs.write(name, False) is FALLING.get(name, Request.NOTHING)
    assert inputs.write(name, False) is Request.NOTHING


def test_names_and_levels_at_rest_are_those_of_the_map() -> None:
    """modbus_map.yaml and the controller agree on all 18 inputs and the buttons at the robot."""
    coils = {name: bit for name, bit in load_modbus_map().coils.items() if name != "gripper"}
    assert tuple(sorted(coils, key=lambda name: coils[name].address)) == INPUTS
    assert tuple(name for name in INPUTS if coils[name].normal) == NORMALLY_ON
