"""What is set on a robot's screens so that the pair can follow and lead it, and where it shows.

The kit prints this table, the doctor names its rows, and the stand-in's files of settings hold its
values.

Source:
    The maker's operator's manual B-83284EN/09, sections 3.3, 3.8, 3.9, 3.15: docs/sources.md.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from scara_config.set_up.slots import WATCHED, Assignment

READY, DELIVERED = "ready", "delivered"
DEFAULT = READY
"""Files of a robot's folder settings/."""
STREAM_RSR = 1
"""This RSR starts the stream program."""
STREAM_NUMBER = 101
"""Its registration number: the program is RSR0101."""
CONNECTIONS = 8
"""Wanted of $SNPX_PARAM.$NUM_MODBUS."""


@dataclass(frozen=True, slots=True)
class Setting:
    """One thing to set.

    Attributes:
        key: As the stand-in's files of settings name it.
        menu: Where it is set, from the MENU key on, or which switch it is.
        wanted: What to set there.
        why: What goes wrong otherwise.
        section: Of the manual B-83284EN/09; empty: the HMI device's own.
        restart: It counts after the controller was switched off and on.
        leads: Only a robot that is led needs it; to be followed it does without.
    """

    key: str
    menu: str
    wanted: str
    why: str
    section: str
    restart: bool = False
    leads: bool = True

    @property
    def advice(self) -> str:
        """Say what to do, and where."""
        place = self.menu if self.menu.startswith("the ") else f"MENU > {self.menu}"
        return f"{place}: {self.wanted}" + ", then switch off and on" * self.restart


_VARIABLES = "SYSTEM > Variables"
_CONFIG = "SYSTEM > Config"
_SELECT = "SETUP > Prog Select"
_FRAMES = "SETUP > Frames"
TOOL_NUMBER = "$MNUTOOLNUM[1]"
"""The tool frame that is selected; 0: none, or nothing shows it."""
SETTINGS = (
    Setting(
        "num_modbus",
        f"{_VARIABLES} > $SNPX_PARAM > $NUM_MODBUS",
        str(CONNECTIONS),
        "0: the Modbus server answers nobody; fewer than needed: clients push each other out",
        "",
        restart=True,
        leads=False,
    ),
    Setting(
        "slots",
        f"{_VARIABLES} > $SNPX_ASG",
        "the sheet of slots",
        "what is assigned to nothing reads 0: no position, no clock",
        "",
        leads=False,
    ),
    Setting(
        "uop",
        f"{_CONFIG} > UOP auto assignment",
        "Full",
        "Simple: no RSR, no SYSRDY, CSTOPI and RESET are one signal. None: no stop from outside. "
        "Changing it clears all I/O assignments",
        "3.3",
        restart=True,
    ),
    Setting(
        "imstp_assigned",
        "I/O > UOP > UI[1] *IMSTP",
        "an input of its own",
        "tied on: an emergency stop from outside leaves the drives on",
        "3.3",
    ),
    Setting(
        "unwired",
        "I/O > UOP > CONFIG, UI[1], UI[2], UI[3], UI[8]",
        "assigned to what can be switched on, and on",
        "an input without a wire is off: *IMSTP no drives, *HOLD and ENBL no motion, *SFSPD slow",
        "3.3",
    ),
    Setting(
        "enable_ui",
        f"{_CONFIG} > Enable UI signals",
        "TRUE",
        "FALSE: no signal from outside counts, no stop either",
        "3.15",
    ),
    Setting(
        "cstopi_for_abort",
        f"{_CONFIG} > CSTOPI for ABORT",
        "TRUE",
        "FALSE: CSTOPI waits for the program's own end; an endless stream never ends",
        "3.15",
    ),
    Setting(
        "start_for_continue",
        f"{_CONFIG} > START for CONTINUE only",
        "TRUE",
        "FALSE: START may begin another program than the paused one",
        "3.15",
    ),
    Setting(
        "remote",
        f"{_CONFIG} > Remote/Local setup",
        "Remote",
        "Local: nothing is started from outside",
        "3.15",
    ),
    Setting(
        "rmt_master",
        f"{_VARIABLES} > $RMT_MASTER",
        "0",
        "another value gives the start to a terminal or a host computer",
        "3.8",
    ),
    Setting(
        "mode",
        "the mode switch",
        "AUTO",
        "T1, T2: nothing is started from outside",
        "3.8",
    ),
    Setting(
        "tp_enabled",
        "the teach pendant's switch",
        "OFF",
        "ON: nothing is started from outside",
        "3.8",
    ),
    Setting(
        "select_mode",
        f"{_SELECT} > Program select mode",
        "RSR",
        "another mode: RSR1 starts nothing",
        "3.8.4",
        restart=True,
    ),
    Setting(
        "rsr",
        f"{_SELECT} > RSR > DETAIL > RSR1 program number",
        f"ENABLE, {STREAM_NUMBER}",
        f"else RSR1 does not start RSR{STREAM_NUMBER:04d}, the stream program",
        "3.8.1",
    ),
    Setting(
        "job_base",
        f"{_SELECT} > RSR > DETAIL > Base number",
        "0",
        "it is added to the number of the program",
        "3.8.1",
    ),
    Setting(
        "user_frame",
        f"{_FRAMES} > User Frame > SETIND",
        "0",
        "programs whose positions name another frame than the one selected stop",
        "3.9.2",
    ),
    Setting(
        "tool_frame",
        f"{_FRAMES} > Tool Frame > SETIND",
        "1",
        "as the user frame; its numbers are 0 (DETAIL) where no program sets UTOOL[1]",
        "3.9.1",
    ),
    Setting(
        "programs",
        "SELECT > CREATE, then SETUP > BG Logic",
        "the sheet of programs",
        "without them no watchdog, nothing to lead by",
        "4",
    ),
)
"""In the order in which they are set: what ends a connection or clears others comes first."""


def setting(key: str) -> Setting:
    """Return the row of a key.

    Raises:
        KeyError: There is none.
    """
    return {row.key: row for row in SETTINGS}[key]


@dataclass(frozen=True, slots=True)
class Wanted:
    """A variable that says whether a setting is as it should be.

    Attributes:
        key: Of the setting.
        variable: Of the controller.
        value: As it should be.
        said: What it means where it is not, with the value's place.
    """

    key: str
    variable: str
    value: int
    said: str


WANTED = (
    Wanted("enable_ui", "$OPWORK.$UOP_DISABLE", 0, "the inputs UI are disabled"),
    Wanted("cstopi_for_abort", "$SHELL_CFG.$USE_ABORT", 1, "CSTOPI does not end a program"),
    Wanted("start_for_continue", "$SHELL_CFG.$CONT_ONLY", 1, "START may begin another program"),
    Wanted("rmt_master", "$RMT_MASTER", 0, "$RMT_MASTER is {}"),
    Wanted("rsr", "$SHELL_CFG.$RSR_ENABLE[1]", 1, "RSR1 is disabled"),
    Wanted("rsr", "$SHELL_CFG.$NUM_RSR[1]", STREAM_NUMBER, "RSR1 starts RSR{:04d}"),
    Wanted("job_base", "$SHELL_CFG.$JOB_BASE", 0, "RSR1 starts RSR0101 and {} more"),
    Wanted("user_frame", "$MNUFRAMENUM[1]", 0, "user frame {} is selected"),
    Wanted("tool_frame", TOOL_NUMBER, 1, "tool frame {} is selected"),
)
"""In the order of ``SETTINGS``."""


def connections_needed(leads: bool) -> int:
    """Return how many clients the robot serves at once: who only follows, reads by one.

    Who leads writes by another, and the pendant has one of its own.
    """
    return 3 if leads else 1


@dataclass(frozen=True, slots=True)
class Watched:
    """Settings as a client reads them, from the slots ``WATCHED``.

    Attributes:
        numbers: Of the variables, by their names.
        si, so: Levels of SI[0..15] and SO[0..15], the operator's panel.
        ui, uo: Levels of UI[1..18] and UO[1..20].
    """

    numbers: Mapping[str, int]
    si: tuple[bool, ...]
    so: tuple[bool, ...]
    ui: tuple[bool, ...]
    uo: tuple[bool, ...]

    @property
    def there(self) -> bool:
        """The slots are there: each controller has 80."""
        # What is assigned to nothing reads 0 and is no error: this number is 80 on each controller.
        return self.numbers["$SNPX_PARAM.$NUM_ASG"] == 80

    def differ(self) -> Iterator[tuple[str, str]]:
        """Yield key and what it means of each setting that is not as it should be, once."""
        told: set[str] = set()
        for each in WANTED:
            value = self.numbers[each.variable]
            if value != each.value and each.key not in told:
                told.add(each.key)
                yield each.key, each.said.format(value)


WATCHED_COUNT = WATCHED[-1].last - WATCHED[0].address + 1


def watched_of(words: list[int]) -> Watched:
    """Return the settings in the ``WATCHED_COUNT`` words of these slots."""

    def of(slot: Assignment) -> list[int]:
        begin = slot.address - WATCHED[0].address
        return words[begin : begin + slot.size]

    def bits(slot: Assignment, count: int) -> tuple[bool, ...]:
        # The low word first, as this controller has all its numbers.
        whole = sum(word << 16 * at for at, word in enumerate(of(slot)))
        return tuple(bool(whole >> bit & 1) for bit in range(count))

    # A number has the factor 1; signals, sixteen a word, have 0.
    values = {slot.name: of(slot)[0] | of(slot)[1] << 16 for slot in WATCHED if slot.multiply}
    si, so, ui, uo = (slot for slot in WATCHED if not slot.multiply)
    return Watched(values, bits(si, 16), bits(so, 16), bits(ui, 18), bits(uo, 20))
