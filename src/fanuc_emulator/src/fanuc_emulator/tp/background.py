"""Background logic: the program that watches the client's heartbeat."""

from __future__ import annotations

from scara_config.programs.tp.execution import background
from scara_config.programs.tp.listing import Indexed
from scara_config.programs.tp.values import as_number
from scara_config.set_up.kit_programs import PERIOD_MS, watch_program

from fanuc_emulator.snapshot import WatchdogState
from fanuc_emulator.tp.registers import Registers

HEARTBEAT, _ECHO, _STATE = (Indexed("R", (float(number),)) for number in (1, 8, 9))


class Background:
    """Execute BGTWIN each 8 ms.

    Args:
        registers: Of the controller.
        patience_ms: The heartbeat may stand still for so long.
        there: The program is typed in and runs; else nobody watches.

    Attributes:
        echo: R[8], the heartbeat as it read it last.
        state: R[9].
    """

    def __init__(self, registers: Registers, patience_ms: int, there: bool) -> None:
        self._registers = registers
        self._scan = background(watch_program(patience_ms)) if there else None
        self.echo, self.state = 0, WatchdogState.DISARMED

    def scan(self, now_ms: int) -> bool:
        """Execute it if it is due; return whether it was."""
        if self._scan is None or now_ms % PERIOD_MS:
            return False
        self._scan(self._registers)
        self.echo = round(as_number(self._registers.read(_ECHO)))
        self.state = WatchdogState(round(as_number(self._registers.read(_STATE))))
        return True
