"""Reading the whole robot at once: the stand-in's own server, and robots that do not answer."""

from __future__ import annotations

import pytest
from harness.emulated.served import CONFIG, LAYOUT, running
from harness.opponents.modbus_robot import Robot
from harness.processes import free_port
from operator_panel.link.register_reader_io import RegisterReadError, read_frames, read_registers
from scara_config.frames import find_frames, frame_differences
from scara_config.quantities import ServerAddress


def test_every_register_of_the_stand_in_is_read_with_its_value() -> None:
    """None is refused, long ones come in several requests; the robot stands at home."""
    with running() as stand_in:
        address = ServerAddress("127.0.0.1", stand_in.port)
        found = {(one.table, one.name): one for one in read_registers(address, LAYOUT)}
        frames = read_frames(address, LAYOUT)
    assert list(frame_differences(frames, find_frames(CONFIG), "robot")) == []
    assert frames["user", 1] == (50.0, -450.0, -40.0, 0.0, 0.0, 0.0) and len(frames) == 19
    position = found["holding_registers", "position"].value.split(", ")
    assert float(position[2]) == pytest.approx(-160.0, abs=0.01)
    assert found["coils", "imstp"].value == "on", "*IMSTP is on at rest"
    assert found["discrete_inputs", "fault"].value == "off"
    assert all(one.value and one.raw for one in found.values())


def test_robot_that_is_not_there_is_named_with_what_to_look_at() -> None:
    """The address stands in the text."""
    port = free_port()
    with pytest.raises(RegisterReadError, match=rf"no robot answers at 127.0.0.1:{port}: is it on"):
        read_registers(ServerAddress("127.0.0.1", port), LAYOUT)


@pytest.mark.parametrize(
    ("fault", "error"),
    [
        ("exception", r"refuses \w+ at \d+: exception 2"),
        ("close", r"was lost while it was read"),
        ("short", r"lost while it was read|gave only a part of \w+"),
    ],
)
def test_robot_that_refuses_or_breaks_off_is_no_list_of_zeros(fault: str, error: str) -> None:
    """What was not read is not shown."""
    robot = Robot()
    robot.fault = fault
    try:
        with pytest.raises(RegisterReadError, match=error):
            read_registers(ServerAddress("127.0.0.1", robot.port), LAYOUT)
    finally:
        robot.close()
