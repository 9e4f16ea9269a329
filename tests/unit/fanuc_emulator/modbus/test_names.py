"""The names of $SNPX_ASG: which variables they are, which are none, and those of a map."""

from __future__ import annotations

import contextlib
from pathlib import Path

import msgspec
import pytest
from fanuc_emulator.snpx.assignments import power_up
from fanuc_emulator.snpx.variables import VariableError, parse
from hypothesis import given
from hypothesis import strategies as st
from scara_config import ConfigError
from scara_config.modbus_map import ModbusMap, load_modbus_map

LAYOUT = load_modbus_map(Path(__file__).resolve().parents[4] / "config")


@pytest.mark.parametrize(
    "name",
    ["", "R", "R[", "R[201]", "PR[0]", "POS[1]", "r[1]", "R[1]@0.1", "R[1]@2.2", "R[1]@1.0"]
    + ["ALM[101]", "UI[19]", "$MCR", "$MCR.$GENOVERRIDE[1]", "$SNPX_ASG[81].$SIZE", "R[1] "]
    + ["$MNUTOOL[1,0]", "$MNUTOOL[1,11]", "$MNUFRAME[1,0]", "$MNUFRAME[1,10]"],
)
def test_a_name_that_is_none_is_refused(name: str) -> None:
    """With what was wrong."""
    with pytest.raises(VariableError):
        parse(name)


@pytest.mark.parametrize(
    ("name", "first", "last"),
    [("R", 1, 200), ("PR", 1, 100), ("PRG", 1, 100), ("ALM", 1, 100), ("UI", 1, 18), ("UO", 1, 20)]
    + [("DI", 1, 512), ("DO", 1, 512), ("RI", 1, 8), ("RO", 1, 8), ("POS", 0, 0)]
    + [("SI", 0, 15), ("SO", 0, 15), ("$SHELL_CFG.$NUM_RSR", 1, 8)]
    + [("$SHELL_CFG.$RSR_ENABLE", 1, 8)],
)
def test_an_array_has_its_first_and_its_last_element_and_no_other(
    name: str, first: int, last: int
) -> None:
    """Counted as the controller counts; the error says how."""
    for index in (first, last):
        assert parse(f"{name}[{index}]")
    for index in (max(first - 1, 0) if first else last + 1, last + 1):
        with pytest.raises(VariableError, match=rf"the index is outside \[{first}, {last}\]"):
            parse(f"{name}[{index}]")


@given(st.text(max_size=40))
def test_whatever_stands_in_a_name_only_variable_errors_come_out(name: str) -> None:
    """A client may write anything."""
    with contextlib.suppress(VariableError):
        parse(name)


@pytest.mark.parametrize(
    ("name", "change", "message"),
    [
        ("heartbeat", {"variable": ""}, "heartbeat.variable: is missing"),
        ("heartbeat", {"variable": "R[999]"}, r"heartbeat.variable = 'R\[999\]': the index"),
    ],
)
def test_a_map_with_a_wrong_variable_is_refused(
    name: str, change: dict[str, str], message: str
) -> None:
    """With file, key and value."""
    registers = dict(LAYOUT.holding_registers)
    registers[name] = msgspec.structs.replace(registers[name], **change)
    layout: ModbusMap = msgspec.structs.replace(LAYOUT, holding_registers=registers)
    with pytest.raises(ConfigError, match=f"modbus_map.yaml: holding_registers.{message}"):
        power_up(layout)


def test_a_map_with_more_registers_than_entries_is_refused() -> None:
    """57 entries are free for it; the message says so."""
    register = LAYOUT.holding_registers["heartbeat"]
    registers = {
        f"r{k}": msgspec.structs.replace(register, address=12000 + 2 * k) for k in range(58)
    }
    layout: ModbusMap = msgspec.structs.replace(LAYOUT, holding_registers=registers)
    with pytest.raises(ConfigError, match=r"take 58 slots: \$SNPX_ASG has 57 that are free$"):
        power_up(layout)
    del registers["r57"]
    assert len(power_up(layout)) == 80
