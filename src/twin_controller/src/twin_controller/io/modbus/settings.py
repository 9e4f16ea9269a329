"""Numbers that a Modbus link is given."""

from __future__ import annotations

import dataclasses


@dataclasses.dataclass(frozen=True, slots=True)
class ModbusSettings:
    """Address and times of the link [s].

    Attributes:
        poll_period: Of the state block and the signals, on average.
        drift_ppm: Largest drift between the robot's clock and ours, in parts per million.
        timeout: The longest wait for one answer or for a connection.
        status_period: Of the program and alarm blocks, which are also read when FAULT, PROGRUN or
            PAUSED change.
        retry_first: Pause before the first new attempt, short enough for the robot's watchdog;
            doubled at each failure.
        retry_last: Longest pause.
        command_retry: A numbered command that is not confirmed is written again after this.
        command_attempts: It is written at most this often.
        heartbeat: Keep the robot's watchdog awake.
        alone: Somebody else has written the heartbeat: the link is used again once nobody has for
            so long.
    """

    host: str
    port: int
    poll_period: float = 0.01
    drift_ppm: float = 500.0
    timeout: float = 0.04
    status_period: float = 1.0
    retry_first: float = 0.02
    retry_last: float = 2.0
    command_retry: float = 0.1
    command_attempts: int = 5
    heartbeat: bool = True
    alone: float = 2.0
