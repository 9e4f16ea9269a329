"""What clients read of the controller's settings: its system variables, and its panel's signals.

Source:
    B-83284EN/09, section 3.4 (SI, SO); the variables' names: docs/sources.md.
"""

from __future__ import annotations

from scara_config.map_entries import MODE_BITS
from scara_config.set_up.slots import SLOTS

from fanuc_emulator.alarms import Severity
from fanuc_emulator.settings import ControllerSettings
from fanuc_emulator.snapshot import Snapshot
from fanuc_emulator.tp.executor import ProgramState


def variable(settings: ControllerSettings, family: str, index: int) -> int | None:
    """Return the value of a system variable; None: it shows no setting.

    Args:
        settings: Of the controller.
        family: Key of ``FAMILIES``.
        index: Of the element, from 1.
    """
    match family:
        case "$SHELL_CFG.$NUM_RSR":
            return settings.rsr[index - 1]
        case "$SHELL_CFG.$RSR_ENABLE":
            return int(settings.rsr[index - 1] > 0)
    values = {
        "$RMT_MASTER": settings.rmt_master,
        "$OPWORK.$UOP_DISABLE": int(not settings.enable_ui),
        "$SHELL_CFG.$USE_ABORT": int(settings.cstopi_for_abort),
        "$SHELL_CFG.$CONT_ONLY": int(settings.start_for_continue),
        "$SHELL_CFG.$JOB_BASE": settings.job_base,
        "$MNUFRAMENUM": settings.user_frame,
        "$MNUTOOLNUM": settings.tool_frame,
        "$SNPX_PARAM.$NUM_ASG": SLOTS,
        "$SNPX_PARAM.$NUM_MODBUS": settings.num_modbus,
    }
    return values.get(family)


def panel_inputs(settings: ControllerSettings, snapshot: Snapshot) -> frozenset[int]:
    """Return which of SI[0..15] are on: 2 remote, 3 ``*HOLD``, 8 and 9 by the mode switch."""
    b0, b1 = MODE_BITS[settings.mode]
    lit = {2: settings.remote, 3: "panel_hold" in snapshot.inputs, 8: b0, 9: b1}
    return frozenset(number for number, on in lit.items() if on)


def panel_outputs(settings: ControllerSettings, snapshot: Snapshot) -> frozenset[int]:
    """Return which of SO[0..15] are on.

    They are 0 remote, 1 busy, 2 held, 3 fault, 7 the teach pendant's switch. How UO are allocated
    does not matter to them.
    """
    alarm = snapshot.alarm
    lit = {
        0: not settings.local,
        1: snapshot.outputs.busy or snapshot.program_state is ProgramState.RUNNING,
        2: not {"hold", "panel_hold"} <= snapshot.inputs,
        # An alarm that stops is shown before a warning, which lights nothing.
        3: alarm is not None and alarm.code.severity > Severity.WARN,
        7: settings.tp_enabled,
    }
    return frozenset(number for number, on in lit.items() if on)
