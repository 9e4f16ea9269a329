"""Background logic: the program that watches the client's heartbeat, and those of the user."""

from __future__ import annotations

from scara_config.programs.tp.execution import background
from scara_config.programs.tp.listing import Indexed
from scara_config.programs.tp.values import ExecutionError, as_number
from scara_config.set_up.kit_programs import PERIOD_MS, watch_program

from fanuc_emulator.alarms import LINE_REFUSED, USER_ALARM, AlarmCode, RefusedError
from fanuc_emulator.config import EmulatorConfig
from fanuc_emulator.snapshot import WatchdogState
from fanuc_emulator.tp.registers import Registers

HEARTBEAT, _ECHO, _STATE = (Indexed("R", (float(number),)) for number in (1, 8, 9))


class Background:
    """Execute BGTWIN, where it is typed in, and the user's programs each 8 ms.

    Args:
        registers: Of the controller.
        config: How long the heartbeat may stand still, and which programs there are.

    Attributes:
        echo: R[8], the heartbeat as it read it last.
        state: R[9].
        told: Alarms that the last scan has raised, each with its cause; they stop no program.
    """

    def __init__(self, registers: Registers, config: EmulatorConfig) -> None:
        self._registers, self._watches = registers, config.settings.programs == "kit"
        watch = (watch_program(config.heartbeat_timeout_ms),) if self._watches else ()
        self._scans = [background(program) for program in (*watch, *config.background)]
        self.echo, self.state = 0, WatchdogState.DISARMED
        self.told: list[tuple[AlarmCode, str]] = []
        # UALM is ignored while it is executed in each scan. Source: B-83284EN/09, 9.12.2.
        self._kept: list[str] = []

    def scan(self, now_ms: int) -> bool:
        """Execute them if they are due; return whether they were.

        A program with a line that cannot be executed runs no longer.
        """
        if not self._scans or now_ms % PERIOD_MS:
            return False
        found: list[str] = []
        self.told = []
        for scan in list(self._scans):
            try:
                found += scan(self._registers)
            except (ExecutionError, RefusedError) as error:
                self._scans.remove(scan)
                self.told.append((getattr(error, "code", LINE_REFUSED), str(error)))
        self.told += [(USER_ALARM, cause) for cause in found if cause not in self._kept]
        self._kept = found
        if self._watches:
            self.echo = round(as_number(self._registers.read(_ECHO)))
            # Where a program has set R[9] to another number, no line of BGTWIN watches any longer.
            state = round(as_number(self._registers.read(_STATE)))
            known = state in tuple(WatchdogState)
            self.state = WatchdogState(state) if known else WatchdogState.DISARMED
        return True
