"""The list of active alarms."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import pytest
from fanuc_emulator.alarms import Alarm, AlarmCode, AlarmList, RefusedError, Severity, check_ranges
from fanuc_emulator.tp.executor import ProgramState
from scara_config import Robot
from scara_config.programs.files import Taught
from scara_config.programs.tp.execution import flow_of
from scara_config.programs.tp.lines import read_line
from scara_config.programs.tp.listing import Program

from fanuc_emulator import alarms

if TYPE_CHECKING:
    from conftest import Bench

ALL_CODES = [code for code in vars(alarms).values() if isinstance(code, AlarmCode)]


def test_kinds_are_told_apart_by_facility_and_number() -> None:
    """No two kinds share a code, each text names its code."""
    codes = [(code.facility, code.number) for code in ALL_CODES]
    assert len(set(codes)) == len(codes)
    shown = {alarm.text.split(maxsplit=1)[0] for alarm in ALL_CODES}
    assert shown == {
        *("SRVO-001", "SRVO-037", "MOTN-017", "MOTN-018", "MOTN-023", "MOTN-063"),
        *("INTP-128", "INTP-213", "INTP-215", "INTP-216", "INTP-253", "INTP-311"),
        *("VARS-037", "SYST-011", "SYST-012", "PROG-040"),
    }
    assert alarms.IMSTP.text == "SRVO-037 IMSTP input"
    assert all(len(code.text) <= 80 and code.text.isascii() for code in ALL_CODES)


def test_severities_count_as_their_register_says() -> None:
    """0 none, 1 warn, and so on, as the maker lists them."""
    names = ("NONE", "WARN", "PAUSE", "STOP", "SERVO", "ABORT", "SYSTEM")
    assert [(each.name, int(each)) for each in Severity] == [*zip(names, range(7))]


@pytest.mark.parametrize("end", ["lower", "upper"])
@pytest.mark.parametrize("off", [0.9e-6, 1.1e-6])
def test_a_position_at_the_end_of_its_range_may_be_off_by_a_millionth(
    robot: Robot, end: str, off: float
) -> None:
    """Of a radian or a metre; the alarm names axis, place and unit as the pendant does."""
    place = [0.0] * len(robot.joints)
    joint = robot.joints[2]
    place[2] = getattr(joint, end) + (off if end == "upper" else -off)
    if off < 1e-6:
        check_ranges(robot.joints, place)
        return
    shown = f"^J3 = {place[2] * 1e3:.3f} mm, there$"
    with pytest.raises(RefusedError, match=shown) as refused:
        check_ranges(robot.joints, place, ", there")
    assert refused.value.code is alarms.POSITION_LIMIT
    place[2] = math.nan
    with pytest.raises(RefusedError) as refused:
        check_ranges(robot.joints, place)
    assert refused.value.code is alarms.POSITION_INVALID


def test_a_warning_is_shown_but_is_no_fault_and_hides_behind_a_real_alarm() -> None:
    """WARN raises no FAULT; what stops the robot is shown first."""
    active = AlarmList()
    active.add(Alarm(alarms.START_REFUSED, "why", 1.0))
    assert not active.fault
    assert active.shown is not None
    active.add(Alarm(alarms.IMSTP, "switched off", 2.0))
    active.add(Alarm(alarms.START_REFUSED, "again", 3.0))
    assert active.fault
    assert active.shown.code is alarms.START_REFUSED or active.shown.code is alarms.IMSTP
    assert active.shown is not None and active.shown.code is alarms.IMSTP


def test_an_active_alarm_keeps_its_first_cause_and_a_warning_its_last() -> None:
    """The first cause is the one that matters; a warning repeats what was refused last."""
    active = AlarmList()
    for cause in ("first", "second"):
        active.add(Alarm(alarms.IMSTP, cause, 1.0))
    assert active.shown is not None and active.shown.cause == "first"
    active.clear()
    for cause in ("first", "second"):
        active.add(Alarm(alarms.START_REFUSED, cause, 1.0))
    assert active.shown is not None and active.shown.cause == "second"


def test_of_several_alarms_the_newest_is_shown() -> None:
    """The one before it is shown again when the newest is cleared."""
    active = AlarmList()
    active.add(Alarm(alarms.IMSTP, "", 1.0))
    active.add(Alarm(alarms.POSITION_LIMIT, "", 2.0))
    assert active.shown is not None and active.shown.code is alarms.POSITION_LIMIT
    active.clear(keep=[alarms.IMSTP])
    assert active.shown is not None and active.shown.code is alarms.IMSTP


def test_clear_keeps_what_it_is_told_to() -> None:
    """A reset with the emergency stop still pressed keeps that alarm."""
    active = AlarmList()
    active.add(Alarm(alarms.IMSTP, "", 1.0))
    active.add(Alarm(alarms.POSITION_LIMIT, "", 2.0))
    active.clear(keep=[alarms.IMSTP])
    assert active.shown is not None and active.shown.code is alarms.IMSTP
    active.clear()
    assert active.shown is None and not active.fault


@pytest.mark.parametrize("code", ALL_CODES)
def test_date_is_utc_in_six_numbers(code: alarms.AlarmCode) -> None:
    """Year, month, day, hour, minute, second, as the alarm registers hold them."""
    assert Alarm(code, "", 1_700_000_000.9).date == (2023, 11, 14, 22, 13, 20)
    assert code.severity in Severity


@pytest.mark.parametrize(
    ("lines", "said"),
    [
        (["R[51]=1/R[52]"], "division by zero"),
        (["R[50]=(-20)", "OVERRIDE=R[50]"], "an override of -20 % is outside [1, 100]"),
        (["OVERRIDE=R[50]"], "an override of 0 % is outside [1, 100]"),
        (["OVERRIDE=101%"], "an override of 101 % is outside [1, 100]"),
        (["R[50]=99", *["R[50]=R[50]*R[50]"] * 8], "inf is no number that a register holds"),
        (["FOR R[50]=1 TO 3", "R[50]=1.5", "ENDFOR"], "1.5 is no whole number"),
        (["R[50]=7", "$WAITTMOUT=1", "WAIT F[99]=ON TIMEOUT,LBL[R[50]]"], "there is no LBL[7]"),
    ],
)
def test_a_line_that_cannot_be_executed_ends_its_program(
    bench: Bench, lines: list[str], said: str
) -> None:
    """The alarm names program, line and why, nothing moves; a RESET clears it."""
    program = Program("TEST", tuple(map(read_line, [*lines, "J P[1] 50% FINE"])))
    programs = {2: Taught(flow_of(program, "TEST"), {1: (0.5, 0.5, -0.1, 0.0, 0.0)})}
    bench = type(bench)(bench.config, bench.robot, programs)
    stood = bench.run(0.1).positions
    bench.controller.pulse_input("panel_run2")
    shown = bench.run(1.0)
    assert shown.alarm is not None and shown.alarm.code is alarms.LINE_REFUSED
    assert f"line {len(lines)} of TEST" in shown.alarm.cause and said in shown.alarm.cause
    assert shown.outputs.fault and shown.program_state is ProgramState.ABORTED
    assert shown.positions == pytest.approx(stood)
    bench.controller.pulse_input("panel_reset")
    assert bench.run(0.1).alarm is None


@pytest.mark.parametrize(
    ("code", "severity"),
    [
        (alarms.POSITION_LIMIT, Severity.STOP),
        (alarms.NOT_REACHABLE, Severity.STOP),
        (alarms.POSITION_INVALID, Severity.STOP),
        (alarms.IMSTP, Severity.SERVO),
    ],
)
def test_severities_are_those_that_controllers_print(
    code: alarms.AlarmCode, severity: Severity
) -> None:
    """STOP.G of MOTN-017 and -018, STOP.L of INTP-311, SERVO of SRVO-037: alarm histories."""
    assert code.severity is severity
