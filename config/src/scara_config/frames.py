"""User and tool frames, as UFRAME[n] and UTOOL[n] of the robot's controller: frames.yaml.

Frame 0 is the base, tool 0 the frame ``tool_frame`` of robot.yaml; both are there without a file.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from scara_config.loader import ConfigError, load
from scara_config.profile import locate
from scara_config.quantities import AngleDeg, CoordinateMm
from scara_config.writer import Key, replace_file, write_values

FILE = "frames.yaml"
Kind = Literal["user", "tool"]
UserKey = Annotated[str, Meta(pattern=r"^uframe_[1-9]\Z")]
ToolKey = Annotated[str, Meta(pattern=r"^utool_([1-9]|10)\Z")]
PREFIX: dict[Kind, str] = {"user": "uframe_", "tool": "utool_"}
"""Of a frame's name in the file and on tf, before its number."""
MOST: dict[Kind, int] = {"user": 9, "tool": 10}
"""As many as can be selected: settings/ of the stand-in."""
WORDS: dict[Kind, str] = {"user": "UFRAME", "tool": "UTOOL"}
"""As a controller calls them."""
VARIABLES: dict[Kind, str] = {"user": "$MNUFRAME", "tool": "$MNUTOOL"}
"""In which a controller keeps them."""
LETTERS = "XYZWPR"
"""Of a frame's numbers."""
Numbers = tuple[float, ...]
"""X Y Z W P R [mm, deg]."""
Numbered = Mapping[tuple[Kind, int], Numbers]
"""Frames as somebody else has them."""
SAME = 0.01
"""Frames that differ by less [mm, deg] are the same: controllers print thousandths; our choice."""
_HEADER = """\
# User and tool frames: taught on the page, or typed. W, P, R turn about the fixed x, y, z.
# user: by base_link. tool: by tool0; a SCARA's by its flange: at zero joints x is base_link's.
# A controller has them as UFRAME[n] and UTOOL[n].
"""


class TaughtFrame(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One frame by another.

    Attributes:
        name: For people.
        xyz_mm: Its origin.
        wpr_deg: How it is turned.
    """

    name: Annotated[str, Meta(min_length=1, max_length=20)]
    xyz_mm: tuple[CoordinateMm, CoordinateMm, CoordinateMm]
    wpr_deg: tuple[AngleDeg, AngleDeg, AngleDeg] = (0.0, 0.0, 0.0)

    @property
    def numbers(self) -> Numbers:
        """X Y Z W P R [mm, deg]."""
        return *self.xyz_mm, *self.wpr_deg


class FrameTable(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The file frames.yaml.

    Attributes:
        user: UFRAME[n] is ``uframe_n``.
        tool: UTOOL[n] is ``utool_n``.
    """

    user: dict[UserKey, TaughtFrame]
    tool: dict[ToolKey, TaughtFrame]

    def numbered(self, kind: Kind) -> dict[int, TaughtFrame]:
        """Return the frames of a kind by their number, the lowest first."""
        table: dict[str, TaughtFrame] = self.user if kind == "user" else self.tool
        cut = len(PREFIX[kind])
        # By the number: as text utool_10 stands before utool_2.
        return dict(sorted((int(key[cut:]), frame) for key, frame in table.items()))

    def find(self, kind: Kind, number: int) -> TaughtFrame:
        """Return a frame.

        Raises:
            ConfigError: There is none of this number; the text lists those that exist.
        """
        table = self.numbered(kind)
        if number in table:
            return table[number]
        known = ", ".join(f"{n} ({frame.name})" for n, frame in table.items())
        raise ConfigError(f"{kind} frame {number} was never taught: {FILE} has {known or 'none'}")


NO_FRAMES = FrameTable({}, {})
"""What a robot has of which nobody taught any."""


def frame_differences(theirs: Numbered, ours: FrameTable, whose: str) -> Iterator[str]:
    """Yield which frames differ from those of frames.yaml, with both numbers.

    Args:
        theirs: As a robot or a file has them.
        ours: frames.yaml; what it lacks counts as never set: all 0.
        whose: Names the other side.
    """
    for (kind, number), there in sorted(theirs.items(), reverse=True):
        known = ours.numbered(kind).get(number)
        here = known.numbers if known else (0.0,) * len(LETTERS)
        apart = [abs(a - b) for a, b in zip(there, here)]
        # Angles go round: 359.999 deg lies next to 0.
        apart[3:] = [min(each % 360.0, -each % 360.0) for each in apart[3:]]
        if any(each > SAME for each in apart):
            name = f" ({known.name})" if known else ""
            shown = f"{told_numbers(here) if known else 'never taught'}"
            yield f"{WORDS[kind]}[{number}]{name}: {whose} {told_numbers(there)}; here {shown}"


def told_numbers(numbers: Numbers) -> str:
    """Return a frame's numbers as people read them; those that are 0 are left out."""
    shown = [f"{name} {value:.10g}" for name, value in zip(LETTERS, numbers) if value]
    return " ".join(shown) or "X 0"


def save_theirs(
    directory: Path | str | None, theirs: Numbered, ours: FrameTable, from_slots: bool = True
) -> int:
    """Write those of somebody's frames into frames.yaml that differ; return how many.

    They keep the name that they have here.

    Args:
        directory: Folder with all YAML files; None: the package scara_config.
        theirs: As a robot or a file has them.
        ours: frames.yaml.
        from_slots: They were read from a robot, where a slot that is not there reads 0 as well.

    Raises:
        ConfigError: There is no such number, the file cannot be written, or all of a kind read 0
            and some of ours differ; then nothing was written.
    """
    for kind in MOST if from_slots else ():
        read = {at: numbers for at, numbers in theirs.items() if at[0] == kind}
        if not any(map(any, read.values())) and any(frame_differences(read, ours, "")):
            raise ConfigError(
                f"nothing was written: all {WORDS[kind]} of the robot read 0, those of {FILE} do "
                f"not: nobody has set them there, or sheet 2's slot of {VARIABLES[kind]} is missing"
            )
    count = 0
    for (kind, number), numbers in sorted(theirs.items()):
        if any(frame_differences({(kind, number): numbers}, ours, "")):
            known = ours.numbered(kind).get(number)
            name = known.name if known else f"{WORDS[kind]}[{number}]"
            x, y, z, w, p, r = numbers
            save_frame(directory, kind, number, TaughtFrame(name, (x, y, z), (w, p, r)))
            count += 1
    return count


def find_frames(directory: Path | str | None = None) -> FrameTable:
    """Read frames.yaml as :func:`load_frames` does; without the file no frame was taught.

    Raises:
        ConfigError: The file is wrong.
    """
    return load_frames(directory) if locate(FILE, directory).exists() else NO_FRAMES


def load_frames(directory: Path | str | None = None) -> FrameTable:
    """Read frames.yaml of ``directory`` (default: the package scara_config).

    Raises:
        ConfigError: The file is missing or wrong.
    """
    return load(locate(FILE, directory), FrameTable)


def save_frame(directory: Path | str | None, kind: Kind, number: int, frame: TaughtFrame) -> Path:
    """Write a frame in place of the one of its number; all else in the file stays.

    Returns:
        The file.

    Raises:
        ConfigError: There is no such number, or the file cannot be written.
    """
    if not 1 <= number <= MOST[kind]:
        raise ConfigError(f"{kind} frame {number}: allowed are 1 to {MOST[kind]}")
    path = locate(FILE, directory)
    if not path.exists():
        replace_file(path, _HEADER + "user: {}\ntool: {}\n")
    known = load(path, FrameTable).numbered(kind)
    at: Key = (kind, f"{PREFIX[kind]}{number}")
    values = {
        "name": frame.name,
        "xyz_mm": [round(value, 4) for value in frame.xyz_mm],
        "wpr_deg": [round(value, 5) for value in frame.wpr_deg],
    }
    # Value by value where it is there: the comments behind them stay.
    if number in known:
        write_values(path, {(*at, key): value for key, value in values.items()})
    else:
        write_values(path, {at: values})
    return path
