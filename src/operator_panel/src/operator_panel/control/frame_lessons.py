"""How a frame is taught by hand: which points, in which order, and what they give."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scara_config.frames import FrameTable, Kind, TaughtFrame
from scara_description.taught_frames import FrameError, pose_of, tool_frame, tool_tip, user_frame

TOUCHES = ("tip on a fixed point", "the same, turned otherwise", "the same, turned once more")


class FrameLesson(NamedTuple):
    """A way to teach a frame.

    Attributes:
        kind: Of the frame.
        title: For people.
        points: What each point is, in order.
    """

    kind: Kind
    title: str
    points: tuple[str, ...]


LESSONS = {
    "user_3": FrameLesson("user", "User 3", ("origin", "on +x", "in the plane, at +y")),
    "user_4": FrameLesson(
        "user", "User 4", ("for the axes", "on +x", "in the plane, at +y", "origin")
    ),
    "tool_3": FrameLesson("tool", "Tool 3", TOUCHES),
    "tool_6": FrameLesson(
        "tool", "Tool 6", (*TOUCHES, "any place", "from there on +x", "from there on +z")
    ),
}


def taught(lesson: FrameLesson, name: str, poses: Sequence[np.ndarray]) -> TaughtFrame:
    """Return the frame that the points give.

    Args:
        lesson: Which points they are.
        name: Of the frame.
        poses: Of the flange in the base, shape (4, 4) [m].

    Raises:
        FrameError: A point is missing or does not fit, or the name is empty or too long.
    """
    if not 1 <= len(name) <= 20:
        raise FrameError("a name has 1 to 20 letters")
    missing = lesson.points[len(poses) :]
    if missing:
        raise FrameError(f"still to record: {', '.join(missing)}")
    if lesson.kind == "tool":
        return tool_frame(name, poses)
    return user_frame(name, [pose[:3, 3].tolist() for pose in poses])


def jog_axes(table: FrameTable) -> dict[str, np.ndarray]:
    """Return the axes of the user frames by their title, shape (3, 3) each."""
    frames, titles = table.numbered("user"), frame_titles(table, "user")
    return {title: pose_of(frames[number])[:3, :3] for number, title in titles.items()}


def frame_titles(table: FrameTable, kind: Kind) -> dict[int, str]:
    """Return number and name of each frame, as a person chooses it, by its number."""
    return {number: f"{number} {frame.name}" for number, frame in table.numbered(kind).items()}


def shown(frame: TaughtFrame) -> str:
    """Return a frame in words.

    Example:
        >>> shown(TaughtFrame("pallet", (50.0, -450.0, -40.0), (0.0, 0.0, 30.0)))
        'X 50.0 Y -450.0 Z -40.0 mm, W 0.00 P 0.00 R 30.00 deg'
    """
    x, y, z = frame.xyz_mm
    w, p, r = frame.wpr_deg
    return f"X {x:.1f} Y {y:.1f} Z {z:.1f} mm, W {w:.2f} P {p:.2f} R {r:.2f} deg"


def spread_text(lesson: FrameLesson, poses: Sequence[np.ndarray]) -> str:
    """Return how well the tips of a tool's points meet; empty where nothing has to.

    Raises:
        FrameError: They do not.
    """
    if lesson.kind == "user":
        return ""
    _, spread = tool_tip(poses[: len(TOUCHES)])
    return f"; the tips are within {1e3 * spread:.2f} mm"
