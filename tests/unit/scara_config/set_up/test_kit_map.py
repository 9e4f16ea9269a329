"""What a person can type is a whole map: it leads or follows, without a program of ours behind."""

from __future__ import annotations

import pytest
from harness.workspace import ROOT
from scara_config import ConfigError
from scara_config.map_entries import FAST_CLOCK, INPUTS, OUTPUTS
from scara_config.modbus_map import ModbusMap, load_modbus_map, problems
from scara_config.profile import CHOICE
from scara_config.set_up.kit_map import kit_map
from scara_config.set_up.slots import own_slots, slot_problems

TYPED = 12
"""So few slots are typed in some minutes."""


@pytest.fixture(params=["fanuc_sr6ia", "fanuc_sr3ia"])
def own(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> ModbusMap:
    """Give the map of each robot of this maker."""
    monkeypatch.setenv(CHOICE, request.param)
    return load_modbus_map(ROOT / "config")


@pytest.mark.parametrize("leads", [True, False])
def test_what_is_typed_is_a_whole_map(own: ModbusMap, leads: bool) -> None:
    """Nothing is missing, nothing hidden by slot 1; the same again when it is made of itself."""
    found = kit_map(own, leads)
    assert not [*problems(found), *slot_problems(found)]
    assert len(own_slots(found)) <= TYPED
    assert kit_map(found, leads) == found and found.leads == leads
    assert not found.has_panel and not found.has_gripper
    assert found.shows_gripper == (leads and own.shows_gripper)


def test_who_leads_wants_the_robots_own_map(own: ModbusMap) -> None:
    """The kit's map of before, without a signal, has nothing to make it of."""
    with pytest.raises(ConfigError, match=r"has no signal imstp.*put the robot's own map back"):
        kit_map(kit_map(own, leads=False))


def test_only_what_the_kits_programs_keep_is_asked_of_a_program(own: ModbusMap) -> None:
    """R[] of BGTWIN and of the stream; no ring, no speeds; the signals are those of the maker."""
    found = kit_map(own)
    names = {register.variable for register in found.holding_registers.values()}
    assert {name for name in names if name.startswith(("R[", "PR["))} == {
        *("R[1]@1.1", "R[2]@1.1", "R[8]@1.1", "R[9]@1.1", "PR[1]@27.18"),
    }
    assert found.holding_registers["clock_ms"].variable == FAST_CLOCK
    assert (*found.coils,) == INPUTS and (*found.discrete_inputs,) == OUTPUTS
    followed = kit_map(own, leads=False)
    assert not any(name.startswith("R[") for name in map(str, followed.holding_registers))
    assert not followed.coils and not followed.discrete_inputs
