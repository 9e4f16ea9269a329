"""Read a URDF that somebody else wrote; what cannot be used of its joints is told in one line."""

from __future__ import annotations

import re
from collections.abc import Mapping
from xml.etree import ElementTree

import msgspec
import numpy as np
from scara_config import ConfigError
from scara_config.quantities import AngleDeg, CoordinateMm, JointEffort, JointSpeed

from scara_description.urdf import JointFrame, Model, Shape, UrdfError, parse_robot, tree_of

NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
MOST_AXES = 9
TOOL = "tool0"
"""The name that a flange has by ROS-Industrial's rule; taken where nobody names a tool."""


class Foreign(msgspec.Struct, frozen=True):
    """A URDF as it was read.

    Attributes:
        file: Its name, for errors.
        text: As it is.
        root: Parsed.
        model: Its tree.
        tool: The link at the end of the arm.
    """

    file: str
    text: str
    root: ElementTree.Element
    model: Model
    tool: str

    @property
    def arm(self) -> tuple[JointFrame, ...]:
        """Joints that move the tool, base to tool."""
        return tuple(joint for joint in self.model.chain(self.tool) if joint.moves)

    @property
    def moving(self) -> tuple[JointFrame, ...]:
        """The arm's joints, then those that move something else."""
        others = [joint for joint in self.model.joints if joint.moves and joint not in self.arm]
        return (*self.arm, *others)

    def fault(self, kind: str, name: str, what: str) -> ConfigError:
        """Return an error of a joint or link, with the line where it is declared."""
        found = re.search(rf"<{kind}\b[^>]*\bname\s*=\s*[\"']{re.escape(name)}[\"']", self.text)
        line = f", line {self.text[: found.start()].count(chr(10)) + 1}" if found else ""
        return ConfigError(f"{self.file}{line}: {kind} {name}: {what}")


def read_foreign(text: str, file: str, tool: str | None = None) -> Foreign:
    """Read a URDF and find its tool.

    Args:
        text: The URDF.
        file: Its name, for errors.
        tool: The link at the end of the arm; None: ``tool0``, else the end that most joints move.

    Raises:
        ConfigError: It is no URDF, a joint cannot be used, or there are several ends.
    """
    try:
        root = parse_robot(text)
        # Only to name lines in errors: the tree is not known yet.
        empty = Foreign(file, text, root, Model("", {}, ()), "")
        for kind in ("link", "joint"):
            names = [element.get("name", "") for element in root.findall(kind)]
            for name in names:
                if not name or names.count(name) > 1:
                    raise empty.fault(kind, name, "Expected a name of its own")
        for element in root.findall("joint"):
            if element.find("parent") is not None:
                _check_kind(empty, element)
        links: Mapping[str, tuple[Shape, ...]] = {
            link.get("name", ""): () for link in root.findall("link")
        }
        model = tree_of(root, links)
    except UrdfError as error:
        raise ConfigError(f"{file}: {error}") from error
    foreign = Foreign(file, text, root, model, tool or _tool_of(file, model))
    if foreign.tool not in links:
        raise ConfigError(f"{file}: no link {foreign.tool}: it has {', '.join(links)}")
    _check_joints(foreign)
    return foreign


def _check_kind(foreign: Foreign, joint: ElementTree.Element) -> None:
    """Refuse a joint that no servo drives by itself."""
    name, kind = joint.get("name", ""), joint.get("type", "")
    if kind == "continuous":
        ends = f"revolute, with lower and upper within +-{_bounds(AngleDeg)[1] * np.pi / 180:.4g}"
        raise foreign.fault("joint", name, f"type = continuous: Expected {ends} rad")
    if kind not in ("revolute", "prismatic", "fixed"):
        expected = "revolute, prismatic or fixed"
        raise foreign.fault("joint", name, f"type = {kind}: Expected {expected}")
    mimic = joint.find("mimic")
    if mimic is not None and kind != "fixed":
        what = f'mimic = {mimic.get("joint", "")}: Expected a motor of its own, or type="fixed"'
        raise foreign.fault("joint", name, what)


def _check_joints(foreign: Foreign) -> None:
    """Refuse joints whose limits are not there or cannot be."""
    if not foreign.arm:
        raise ConfigError(f"{foreign.file}: no joint moves {foreign.tool}")
    if len(foreign.moving) > MOST_AXES:
        raise ConfigError(
            f"{foreign.file}: {len(foreign.moving)} joints move: Expected 1 to {MOST_AXES}, as a "
            'controller has: set type="fixed" for the others'
        )
    elements = {joint.get("name", ""): joint for joint in foreign.root.findall("joint")}
    for joint in foreign.moving:
        if not NAME.fullmatch(joint.name):
            raise foreign.fault("joint", joint.name, "name: Expected letters, digits and _")
        carried = [each.name for each in foreign.model.chain(joint.parent) if each in foreign.arm]
        if joint not in foreign.arm and carried:
            what = f'moves no tool and hangs on {carried[-1]}: Expected type="fixed", or --tool'
            raise foreign.fault("joint", joint.name, what)
        limit = elements[joint.name].find("limit")
        if limit is None:
            raise foreign.fault(
                "joint", joint.name, "limit: is missing: Expected lower, upper, velocity and effort"
            )
        turns = joint.kind == "revolute"
        scale, unit = (np.pi / 180.0, "rad") if turns else (1e-3, "m")
        place, force = _bounds(AngleDeg if turns else CoordinateMm), "N m" if turns else "N"
        for key, (low, high), size, what in (
            ("lower", place, scale, unit),
            ("upper", place, scale, unit),
            ("velocity", _bounds(JointSpeed), scale, f"{unit}/s"),
            ("effort", _bounds(JointEffort), 1.0, force),
        ):
            try:
                value = float(limit.get(key, ""))
            except ValueError:
                # It compares as outside, and is told with the others.
                value = np.nan
            if not low * size <= value <= high * size:
                shown = limit.get(key)
                found = f"limit {key}: is missing" if shown is None else f"limit {key} = {shown}"
                allowed = f"Expected {low * size:.4g} to {high * size:.4g} {what}"
                raise foreign.fault("joint", joint.name, f"{found}: {allowed}")
        lower, upper = float(limit.attrib["lower"]), float(limit.attrib["upper"])
        if not lower < upper:
            shown = f"limit lower = {lower:g}: Expected less than upper = {upper:g} {unit}"
            raise foreign.fault("joint", joint.name, shown)


def _bounds(quantity: object) -> tuple[float, float]:
    """Return the least and the most that a quantity of the configuration may be."""
    meta = quantity.__metadata__[0]  # type: ignore[attr-defined]
    return float(meta.ge), float(meta.le)


def _tool_of(file: str, model: Model) -> str:
    """Return the link at the end of the arm."""
    if TOOL in model.shapes:
        return TOOL
    parents = {joint.parent for joint in model.joints}
    count = {
        link: sum(joint.moves for joint in model.chain(link))
        for link in model.shapes
        if link not in parents
    }
    most = [link for link, joints in count.items() if joints == max(count.values())]
    if len(most) != 1:
        raise ConfigError(f"{file}: its ends are {', '.join(most)}: give one of them with --tool")
    return most[0]
