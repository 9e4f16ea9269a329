"""Draw the two pictures of the architecture as SVG: .venv/bin/python docs/diagrams.py.

Drawn here and not by the page that shows them, so that they need no script and no other place.
"""

from __future__ import annotations

from dataclasses import dataclass
from html import escape
from pathlib import Path

FOLDER = Path(__file__).parent / "images" / "diagrams"
LINE_PX = 17
STYLE = (
    "text{font:13px sans-serif;fill:#1b2430;text-anchor:middle}"
    ".group{fill:#f3f5f8;stroke:#c3cbd6}.title{font-weight:bold;text-anchor:start}"
    ".real{fill:#d9e8fb;stroke:#1a5fb4}.twin{fill:#fde6d2;stroke:#b4530a}"
    ".centre{fill:#e9e2fb;stroke:#6a3fc4}.other{fill:#fff;stroke:#7a8594}"
    ".arrow{fill:none;stroke:#47515f;stroke-width:1.6}.dashed{stroke-dasharray:5 4}"
)
HEAD = (
    '<marker id="tip" viewBox="0 0 10 10" refX="9" refY="5" markerWidth="7" markerHeight="7" '
    'orient="auto-start-reverse"><path d="M0 0L10 5L0 10z" fill="#47515f"/></marker>'
)

Place = tuple[int, int]


@dataclass(frozen=True)
class Box:
    """A part of the cell, or (``kind`` group) what holds several.

    Attributes:
        kind: Class of the style: real, twin, centre, other, group.
        x, y, width, height: Its place [px].
        text: Lines, a group's title.
    """

    kind: str
    x: int
    y: int
    width: int
    height: int
    text: tuple[str, ...]

    def svg(self) -> str:
        """Return the rectangle and its text."""
        shape = (
            f'<rect class="{self.kind}" x="{self.x}" y="{self.y}" width="{self.width}" '
            f'height="{self.height}" rx="6"/>'
        )
        if self.kind == "group":
            place = f'x="{self.x + 12}" y="{self.y + 22}"'
            return f'{shape}<text class="title" {place}>{escape(self.text[0])}</text>'
        first = self.y + self.height // 2 + 5 - LINE_PX * (len(self.text) - 1) // 2
        return shape + texts(self.text, (self.x + self.width // 2, first))


@dataclass(frozen=True)
class Arrow:
    """A way between two boxes.

    Attributes:
        way: Its corners [px].
        text: Lines beside it.
        at: Middle of the first line [px].
        both: Whether it has two tips.
        dashed: Whether it is drawn so, without a tip.
    """

    way: tuple[Place, ...]
    text: tuple[str, ...] = ()
    at: Place = (0, 0)
    both: bool = True
    dashed: bool = False

    def svg(self) -> str:
        """Return the line and its text."""
        ends = "" if self.dashed else ' marker-end="url(#tip)"'
        ends += ' marker-start="url(#tip)"' if self.both and not self.dashed else ""
        corners = " ".join(f"{x},{y}" for x, y in self.way)
        kind = "arrow dashed" if self.dashed else "arrow"
        return f'<polyline class="{kind}" points="{corners}"{ends}/>{texts(self.text, self.at)}'


def texts(lines: tuple[str, ...], at: Place) -> str:
    """Return lines of text below each other, the first at ``at``."""
    return "".join(
        f'<text x="{at[0]}" y="{at[1] + LINE_PX * k}">{escape(line)}</text>'
        for k, line in enumerate(lines)
    )


def picture(size: Place, title: str, *parts: Box | Arrow) -> str:
    """Return a whole SVG file on white, so that it is read on a dark page too."""
    width, height = size
    return "\n".join(
        [
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" '
            f'width="{width}" height="{height}" role="img">',
            f"<title>{escape(title)}</title><style>{STYLE}</style><defs>{HEAD}</defs>",
            '<rect width="100%" height="100%" fill="#fff"/>',
            *(part.svg() for part in parts),
            "</svg>\n",
        ]
    )


def overview() -> str:
    """Return the picture of README.md: two sides, and what stands between them."""
    return picture(
        (1000, 225),
        "Robot, twin controller and twin",
        Box("group", 10, 10, 190, 125, ("real side",)),
        Box("group", 300, 10, 190, 125, ("centre",)),
        Box("group", 590, 10, 400, 125, ("twin side (ROS)",)),
        Box("real", 25, 50, 160, 65, ("robot, or", "its stand-in")),
        Box("centre", 315, 45, 160, 75, ("twin controller", "who leads, limits,", "stops")),
        Box("twin", 605, 50, 95, 65, ("gateway",)),
        Box("twin", 745, 50, 95, 65, ("motion", "nodes")),
        Box("twin", 885, 50, 92, 65, ("simulator", "(PyBullet)")),
        Box("other", 315, 170, 160, 42, ("operator's page",)),
        Arrow(((185, 82), (315, 82)), ("Modbus", "TCP"), (250, 58)),
        Arrow(((475, 82), (605, 82)), ("web", "socket"), (540, 58)),
        Arrow(((700, 82), (745, 82))),
        Arrow(((840, 82), (885, 82))),
        Arrow(((395, 170), (395, 120)), both=False),
    )


def cell() -> str:
    """Return the picture of docs/architecture.md: all parts, and what goes between them."""
    nodes = (
        "joint_pose_controller",
        "joint_vel_controller",
        "motion_server, trajectory_server",
        "kinematics_server",
        "robot_state_publisher",
    )
    return picture(
        (1000, 475),
        "The parts of the cell",
        Box("group", 10, 10, 200, 245, ("real side",)),
        Box("group", 345, 10, 200, 125, ("centre",)),
        Box("group", 665, 10, 325, 375, ("twin side (ROS)",)),
        Box("real", 25, 50, 170, 62, ("robot, or its stand-in", "(fanuc_emulator)")),
        Box("real", 25, 175, 170, 62, ("pendant,", "pendant page")),
        Box("centre", 360, 45, 170, 75, ("twin_controller", "who leads, limits,", "stops")),
        Box("twin", 680, 50, 150, 62, ("gateway", "(rosbridge_gateway)")),
        Box("other", 862, 50, 115, 62, ("cell_recorder", "(bag, journal)")),
        Box("twin", 680, 165, 297, 92, nodes),
        Box("twin", 680, 305, 297, 62, ("simulator (PyBullet)", "gripper, parts, camera")),
        Box("other", 360, 205, 170, 52, ("operator_panel", "(browser)")),
        Box("other", 360, 312, 170, 46, ("farm: link",)),
        Box("other", 360, 415, 170, 50, ("farm: desk", "(many cells)")),
        Arrow(((110, 175), (110, 112)), ("Modbus",), (140, 149), both=False),
        Arrow(
            ((195, 82), (360, 82)), ("Modbus TCP", "", "samples, set", "points, signals"), (268, 68)
        ),
        Arrow(((530, 82), (680, 82)), ("web socket:", "rosbridge v2"), (605, 58)),
        Arrow(((830, 82), (862, 82)), ("records topics",), (915, 132), dashed=True),
        Arrow(((750, 112), (750, 165)), ("topics, services",), (808, 150)),
        Arrow(((828, 257), (828, 305)), ("set points, joint states",), (906, 286)),
        Arrow(((445, 205), (445, 120)), ("twin_controller/command",), (537, 172), both=False),
        Arrow(((530, 231), (680, 231)), ("jog",), (605, 223), both=False),
        Arrow(((360, 222), (195, 222)), ("programs",), (268, 214), both=False),
        Arrow(
            ((360, 335), (336, 335), (336, 108), (360, 108)), ("command",), (298, 326), both=False
        ),
        Arrow(((445, 415), (445, 358)), ("zenoh",), (470, 392)),
    )


def pictures() -> dict[str, str]:
    """Return the name and the text of each picture."""
    return {"overview.svg": overview(), "cell.svg": cell()}


if __name__ == "__main__":
    FOLDER.mkdir(exist_ok=True)
    for name, text in pictures().items():
        (FOLDER / name).write_text(text, encoding="utf-8")
