"""How late each way of the cell is, and how its clocks run; the defaults are the shipped cell."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Delays:
    """How late things are [s]: medians of docs/benchmarks.md, section state_age.

    Attributes:
        request: From a read's request until its answer; the robot's state is taken half-way.
        decision: From the answer until the decision begins: signals, queue.
        write: From a write until the robot has it: half of a request's 0.49 ms (row modbus_read).
        to_twin: Decision, web socket, gateway, topic.
        from_twin: Topic, gateway, web socket. Our choice: as the way there.
        topic: From one node of the twin to another: gate and publishing.
        jitter: Largest extra delay of each packet on the web socket, drawn evenly.
    """

    request: float = 0.3e-3
    decision: float = 0.3e-3
    write: float = 0.25e-3
    to_twin: float = 0.7e-3
    from_twin: float = 0.7e-3
    topic: float = 0.4e-3
    jitter: float = 0.0


@dataclass(frozen=True)
class Clocks:
    """The clocks beside the true one; how fast the robot's runs stands in emulator.yaml.

    Attributes:
        controller_offset: What the controller's monotonic clock shows at the beginning [s].
        twin_offset: What the twin's ROS clock shows at the beginning [s].
        twin_drift_ppm: By how much it runs fast.
    """

    controller_offset: float = 100.0
    twin_offset: float = 1_700_000_000.25
    twin_drift_ppm: float = -20.0


SHIPPED = Delays()
CLOCKS = Clocks()
