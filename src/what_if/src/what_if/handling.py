"""What the gripper takes, sets down or drops, by the rules of the simulated cell's suction."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scara_config.palletise import Palletise
from scara_description.vehicle import VEHICLE

from what_if.geometry.bodies import Body, FloatArray, Kind
from what_if.geometry.tree import Tree
from what_if.world import Cell, Part

MM = 1e-3
PALLET = "pallet"


@dataclass(frozen=True)
class Switched:
    """What came of switching the suction.

    Attributes:
        parts: All parts afterwards.
        placed: Where a part was set down, in words; empty if none was.
        dropped: Why a part falls, in words; empty if none does.
        missed: Why nothing was gripped, in words; empty if something was.
        part: The part that was concerned; empty if none was.
    """

    parts: tuple[Part, ...]
    placed: str = ""
    dropped: str = ""
    missed: str = ""
    part: str = ""


def switch(cell: Cell, parts: Sequence[Part], q: Sequence[float], on: bool) -> Switched:
    """Switch the suction with the joints at rest.

    Args:
        cell: The cell; without parts and gripper nothing can be gripped.
        parts: Where they are.
        q: Joint positions, shape (n,), SI.
        on: Grip, or let go.
    """
    tree, tool = cell.tree, cell.robot.tool_frame
    poses = tree.poses(np.array([q]))[0]
    held = next((part for part in parts if part.link == tool), None)
    if cell.work is None:
        return Switched(tuple(parts), missed="this cell has no gripper" if on else "")
    if on and held is None:
        return _grip(cell.work, tree, tool, parts, poses)
    if not on and held is not None:
        pose = poses[tree.index[held.link]] @ held.pose
        under = pose[:3, 3] - np.array((0.0, 0.0, 0.5 * cell.work.parts.height))
        rest, gap = _rest_below(cell.work, tree, poses, under)
        if not rest or gap > cell.work.watch.drop_mm * MM:
            where = f"{gap / MM:.0f} mm above {rest}" if rest else "above no stand and no pallet"
            text = f"{held.name} would be dropped: it is let go {where}"
            left = tuple(part for part in parts if part.name != held.name)
            return Switched(left, dropped=text, part=held.name)
        link = poses[tree.index[rest]]
        down = pose.copy()
        down[2, 3] -= gap
        laid = Part(held.name, rest, np.linalg.inv(link) @ down)
        x, y, _ = under / MM
        placed = f"{held.name} on {rest} at ({x:.1f}, {y:.1f}) mm"
        return Switched(_with(parts, laid), placed=placed, part=held.name)
    return Switched(tuple(parts))


def _grip(
    work: Palletise, tree: Tree, tool: str, parts: Sequence[Part], poses: FloatArray
) -> Switched:
    nozzle = poses[tree.index[tool]]
    offset, reach = work.gripper.offset_mm * MM, work.gripper.reach_mm * MM
    nearest = math.inf
    for part in parts:
        pose = poses[tree.index[part.link]] @ part.pose
        aside = math.hypot(*(pose[:2, 3] - nozzle[:2, 3]))
        gap = float(nozzle[2, 3] - pose[2, 3]) - 0.5 * work.parts.height
        if aside <= offset and abs(gap) <= reach:
            taken = Part(part.name, tool, np.linalg.inv(nozzle) @ pose)
            return Switched(_with(parts, taken), part=part.name)
        nearest = min(nearest, math.hypot(aside, gap))
    far = f"the nearest part is {nearest / MM:.0f} mm away" if parts else "there are no parts"
    return Switched(tuple(parts), missed=f"there is nothing to grip: {far}")


def _rest_below(
    work: Palletise, tree: Tree, poses: FloatArray, under: FloatArray
) -> tuple[str, float]:
    """Return the rest below a part and how far below its underside it is [m].

    The part's middle has to be above the rest, else it tips over.
    """
    best, least = "", math.inf
    carriers = [PALLET, *([VEHICLE] if VEHICLE in tree.index else [])]
    for rest in (*work.table.stands_mm, *carriers):
        frame = poses[tree.index[rest]]
        # In the rest's own frame: a stand may have turned with the table.
        x, y, gap = frame[:3, :3].T @ (under - frame[:3, 3])
        if rest in carriers:
            width, depth = work.pallet.size_mm
            above = abs(x) <= 0.5 * width * MM and abs(y) <= 0.5 * depth * MM
        else:
            above = math.hypot(x, y) <= work.table.stand_radius_mm * MM
        # An underside a little below the top stands on it too: a part may be pressed.
        if above and -work.parts.height < gap < least:
            best, least = rest, float(gap)
    return best, max(least, 0.0) if best else 0.0


def _with(parts: Sequence[Part], changed: Part) -> tuple[Part, ...]:
    return tuple(changed if part.name == changed.name else part for part in parts)


def part_bodies(work: Palletise, tool: str, parts: Sequence[Part]) -> list[Body]:
    """Return the parts as bodies; the one at the tool is held."""
    size = (work.parts.radius, work.parts.height)
    return [
        Body(
            part.name,
            Kind.HELD if part.link == tool else Kind.PART,
            part.link,
            "cylinder",
            size,
            part.pose,
        )
        for part in parts
    ]


def parts_at_start(cell: Cell) -> tuple[Part, ...]:
    """Return all parts where palletise.yaml says that they begin."""
    if cell.work is None:
        return ()
    # palletise.yaml tells where parts lie with the table at 0, wherever its home is.
    zero = cell.tree.poses(np.zeros((1, len(cell.tree.joints))))[0]
    found = []
    for start in cell.work.starts():
        pose = np.eye(4)
        pose[:3, 3] = start.x, start.y, start.z + 0.5 * cell.work.parts.height
        found.append(lay(cell, Part(start.name, "", pose), start.stand, zero))
    return tuple(found)


def found_part(cell: Cell, name: str, pose: FloatArray, q: Sequence[float], held: bool) -> Part:
    """Return a part that was seen somewhere, on the link that carries it.

    Args:
        cell: The cell, with palletise.yaml.
        name: Of the part.
        pose: Of its middle in the base frame, shape (4, 4), translation in [m].
        q: Where the joints were then, shape (n,), SI.
        held: It hangs at the tool.
    """
    tree, poses = cell.tree, cell.tree.poses(np.array([q]))[0]
    link = cell.robot.tool_frame
    if not held:
        assert cell.work is not None
        under = pose[:3, 3] - np.array((0.0, 0.0, 0.5 * cell.work.parts.height))
        rest, gap = _rest_below(cell.work, tree, poses, under)
        # What lies neither on a stand nor on the pallet moves with nothing.
        link = rest if rest and gap <= cell.work.watch.drop_mm * MM else tree.links[0]
    return lay(cell, Part(name, link, pose), link, poses)


def lay(cell: Cell, part: Part, link: str, poses: FloatArray) -> Part:
    """Return a part, whose pose is one in the base frame, as lying on a link."""
    frame = poses[cell.tree.index[link]]
    return replace(part, link=link, pose=np.linalg.inv(frame) @ part.pose)
