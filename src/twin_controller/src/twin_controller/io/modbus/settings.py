"""Numbers that a Modbus link is given, and numbers that it counts."""

from __future__ import annotations

import dataclasses


@dataclasses.dataclass(frozen=True, slots=True)
class ModbusSettings:
    """Address and times of the link [s].

    Attributes:
        poll_period: Of the state block and the signals.
        timeout: The longest wait for one answer or for a connection.
        status_period: Of the program and alarm blocks, which are also read when FAULT, PROGRUN or PAUSED change.
        pulse: How long a pulsed signal stays on.
        retry_first: Pause before the first new attempt, short enough for the robot's watchdog; doubled at each failure.
        retry_last: Longest pause.
        stream_speed_margin: R[2] above the speed of the set points: right at the robot's own limit they would be clipped and lag.
        heartbeat: Keep the robot's watchdog awake.
    """

    host: str
    port: int
    poll_period: float = 0.01
    timeout: float = 0.04
    status_period: float = 1.0
    pulse: float = 0.03
    retry_first: float = 0.02
    retry_last: float = 2.0
    stream_speed_margin: float = 1.2
    heartbeat: bool = True


@dataclasses.dataclass(slots=True)
class ModbusCounters:
    """What went over the link since its start; times in s."""

    polls: int = 0
    samples: int = 0
    rejected: int = 0
    late: int = 0
    setpoints: int = 0
    refused: int = 0
    dropped: int = 0
    connects: int = 0
    losses: int = 0
    round_trip: float = 0.0
    longest_round_trip: float = 0.0
