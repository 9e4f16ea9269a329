"""The fourth group, before all else: is the robot's controller set up for the pair?

A gap is named with the menu where it is closed. All of it is read: nothing is written, and nothing
moves.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import msgspec
from scara_config.frames import FILE, NO_FRAMES, FrameTable, Kind, frame_differences
from scara_config.loader import ConfigError
from scara_config.modbus_map import ModbusMap
from scara_config.profile import chosen_robot
from scara_config.set_up.kit_programs import STREAM, WATCH
from scara_config.set_up.settings import TOOL_NUMBER, Setting, Watched, setting, watched_of
from scara_config.set_up.slots import FRAMES, WATCHED, Assignment, frames_of, own_slots, slot_table
from scara_config.stopping import stops_command

from robot_doctor.finding import Finding, Group, Level, fine, note

Words = tuple[int, ...]
_SMALL, _LARGE = 0x0DA24260, 0x7FC00000
"""1e-30 and NaN, of an axis that is not there, as bits of a float32; -1 as int32 lies above."""
_LEVELS = {0: "UI[1] *IMSTP", 1: "UI[2] *HOLD", 2: "UI[3] *SFSPD", 7: "UI[8] ENBL"}


class SetUp(msgspec.Struct, frozen=True):
    """What a robot shows of its set-up.

    Attributes:
        served: So many of the clients that are needed were served at once; 0: nobody listens.
        why: Nobody listens: what came instead, and where.
        needed: So many are needed.
        words: Of each slot of the map, at one time and a while later, by its address.
        watched: Words of the slots ``WATCHED``.
        frames: Words of the slots ``FRAMES``.
    """

    served: int
    needed: int
    words: Mapping[int, tuple[Words, Words]]
    watched: Words
    frames: Mapping[Kind, Words] = {}
    why: str = ""


def check_set_up(
    layout: ModbusMap, found: SetUp, led: bool, taught: FrameTable = NO_FRAMES
) -> Iterator[Finding]:
    """Yield each gap between a robot and its set-up, or that there is none.

    Args:
        layout: modbus_map.yaml; its registers name variables.
        found: What the robot shows.
        led: The pair may lead this robot; else what only leading needs is but to be looked at.
        taught: frames.yaml.
    """
    gaps = list(_gaps(layout, found))
    for row, what in gaps:
        level = Level.WRONG if led or not row.leads else Level.NOTE
        yield Finding(Group.LINKS, level, what, row.advice)
    watched = watched_of(list(found.watched))
    if found.served and watched.there and not watched.numbers[TOOL_NUMBER]:
        slot = _named(slot_table(layout), WATCHED[-1])
        yield note(
            Group.LINKS,
            f"{slot} reads 0: it shows nothing, or tool frame 0 is selected",
            f"{setting('user_frame').advice}; {setting('tool_frame').advice}",
        )
    if found.served and watched.there:
        yield note(
            Group.LINKS,
            "two settings cannot be seen from here",
            f"{setting('select_mode').advice}; {setting('imstp_assigned').advice}",
        )
    # The kit's own map has the controller's clock, which runs without any program; and what a
    # program copies differs only while somebody writes, which the doctor does not.
    hidden = "heartbeat_echo" in layout.holding_registers and not _program_clock(layout)
    if hidden and found.served and watched.there:
        yield note(
            Group.LINKS,
            f"whether {STREAM} is there and {WATCH} runs cannot be seen from here",
            f"{setting('programs').advice}; {stops_command(chosen_robot())} tries both",
        )
    if found.served and watched.there:
        yield from _frames(found.frames, taught)
    if not gaps:
        but = ", as far as this map shows it" if hidden else ""
        yield fine(Group.LINKS, f"the controller is set up as the kit says{but}")


def _frames(words: Mapping[Kind, Words], taught: FrameTable) -> Iterator[Finding]:
    """Yield which frames differ from frames.yaml: the pair does without, programs do not."""
    menu = "MENU > SETUP > Frames > DETAIL"
    if not any(map(any, words.values())):
        if taught != NO_FRAMES:
            names = ", ".join(slot.name for slot in FRAMES.values())
            what = f"the robot's frames read 0, those of {FILE} are not there"
            yield note(Group.LINKS, what, f"{menu}: type them; or the slots {names} are missing")
        return
    try:
        theirs = frames_of(words)
    except ConfigError as error:
        yield note(Group.LINKS, str(error), f"{setting('slots').advice}")
        return
    for line in frame_differences(theirs, taught, "robot"):
        save = f"rosrun fanuc_kit frames ADDRESS --save --robot {chosen_robot()}"
        advice = f"`{save}` takes the robot's, {menu} ours"
        yield note(Group.LINKS, line, advice)


def _gaps(layout: ModbusMap, found: SetUp) -> Iterator[tuple[Setting, str]]:
    """Yield gaps as far as they can be told apart: who is not served sees no slot."""
    if not found.served:
        yield (
            setting("num_modbus"),
            f"no Modbus server: $SNPX_PARAM.$NUM_MODBUS is 0, or nothing runs: {found.why}",
        )
        return
    if found.served < found.needed:
        yield (
            setting("num_modbus"),
            f"{found.served} of {found.needed} clients are served at once, as "
            "$SNPX_PARAM.$NUM_MODBUS says",
        )
        return
    watched = watched_of(list(found.watched))
    # Registers without a slot read 0: no exception tells that they are not there.
    if not any(found.watched) and not any(any(first) for first, _ in found.words.values()):
        yield setting("slots"), "none of our slots is there: $SNPX_ASG is as delivered"
        return
    yield from _slots(layout, found, watched)
    if watched.there:
        yield from _settings(watched)
    else:
        slot = _named(slot_table(layout), WATCHED[0])
        yield (
            setting("slots"),
            f"{slot} reads {watched.numbers[WATCHED[0].name]}, not 80: settings cannot be judged",
        )


def _slots(layout: ModbusMap, found: SetUp, watched: Watched) -> Iterator[tuple[Setting, str]]:
    """Yield slots whose words cannot be what they should."""
    table, clock = slot_table(layout), _program_clock(layout)
    for slot in own_slots(layout):
        first, later = found.words[slot.address]
        problem = ""
        if slot.name.startswith("POS[0]") and slot.size >= 19:
            problem = _position(first)
        elif slot.name == "$MCR.$GENOVERRIDE":
            # A controller gives the low word first.
            percent = first[0] | first[1] << 16
            if not percent:
                problem = "reads 0, an override is 1 to 100"
            elif percent > 100:
                problem = f"reads {percent}, an override is 1 to 100: $MULTIPLY must be 1"
        elif slot.name == "SI[8]" and watched.there:
            if tuple(map(bool, first)) != watched.si[8 : 8 + len(first)]:
                problem = "does not show the mode switch, SI[0] does"
        elif slot.name == clock and first == later:
            if any(first):
                yield setting("programs"), f"the clock in {slot.name} stands still"
            else:
                yield setting("programs"), f"{slot.name} is 0: no background program, or no slot"
        if problem:
            yield setting("slots"), f"{_named(table, slot)} {problem}"


def _position(words: Words) -> str:
    """Say what is wrong with POS[0], or nothing."""
    if not any(words):
        return "reads 0"
    if words[18] != 1:
        return f"calls its position not valid ({words[18]})"
    numbers = [words[at] | words[at + 1] << 16 for at in range(0, 18, 2)]
    # A float32 of a usual size has bits in its exponent; a small whole number has none.
    # Without its sign: a joint that counts against its motor stands at -0.0 in its zero position.
    sizes = [size for number in numbers if (size := number & 0x7FFFFFFF)]
    if any(not _SMALL <= size <= _LARGE for size in sizes):
        return "holds whole numbers: $MULTIPLY must be 0"
    return ""


def _settings(found: Watched) -> Iterator[tuple[Setting, str]]:
    """Yield settings that are not as they should be."""
    for index, name in _LEVELS.items():
        if not found.ui[index]:
            yield setting("unwired"), f"{name} is off: without a wire, or somebody switched it off"
    for key, said in found.differ():
        # A slot that is not typed, or shows no variable of one byte, reads 0 too: that is a note.
        if key != "tool_frame" or found.numbers[TOOL_NUMBER]:
            yield setting(key), said
    if not (found.si[8] and found.si[9]):
        yield setting("mode"), "the mode switch is not at AUTO"
    if found.so[7]:
        yield setting("tp_enabled"), "the teach pendant is enabled"
    if not found.si[2]:
        yield setting("remote"), "the robot is Local"
    if found.uo[0] and not found.uo[1]:
        yield setting("uop"), "CMDENBL is on without SYSRDY: UOP is Simple"
    elif not any(found.uo) and found.so[0] and not found.so[3]:
        yield setting("uop"), "no output UO is on, and nothing is wrong: UOP is None"


def _program_clock(layout: ModbusMap) -> str:
    """Return the variable of the clock that a background program keeps; empty: none does."""
    clock = layout.holding_registers.get("clock_ms")
    name = clock.variable if clock is not None else ""
    return name if name.startswith("R[") else ""


def _named(table: Sequence[Assignment], slot: Assignment) -> str:
    """Return a slot as the kit's sheet has it."""
    at = f"address {slot.address}, size {slot.size}, $MULTIPLY {slot.multiply:g}"
    return f"slot {table.index(slot) + 1} ({slot.name}: {at})"
