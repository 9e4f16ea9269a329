"""The rooms and their arrows: which package may use which, declared here and nowhere else.

This is the table of docs/decisions/0011. A room may also use what its rooms use only if it says so:
arrows are not inherited.
"""

from __future__ import annotations

import sys

MESSAGES = {"scara_msgs", "control_msgs", "industrial_msgs"}
FLOOR = {"scara_config", "scara_ros"}
NODE = MESSAGES | FLOOR

ROOMS: dict[str, set[str]] = {
    "scara_config": set(),
    "control_msgs": set(),
    "industrial_msgs": set(),
    "scara_msgs": set(),
    "scara_ros": {"scara_config"},
    "scara_description": FLOOR,
    "scara_control": NODE | {"scara_description"},
    "scara_simulation": NODE | {"scara_control", "scara_description"},
    "rosbridge_gateway": NODE,
    "fanuc_emulator": FLOOR | {"scara_msgs"},
    "twin_controller": NODE | {"scara_control"},
    "cell_recorder": NODE,
    "robot_doctor": FLOOR
    | {"scara_control", "scara_description", "scara_simulation", "twin_controller", "what_if"},
    "fanuc_kit": FLOOR | {"twin_controller"},
    "what_if": FLOOR
    | {"scara_msgs", "scara_control", "scara_description", "scara_simulation"}
    | {"cell_recorder", "fanuc_emulator"},
    "twin_experiments": NODE | {"scara_control", "cell_recorder"},
    "twin_analysis": NODE
    | {"scara_control", "scara_simulation", "fanuc_emulator", "twin_controller"}
    | {"cell_recorder", "twin_experiments"},
    "scara_course": FLOOR
    | {"scara_msgs", "scara_control", "cell_recorder", "twin_experiments", "twin_analysis"},
    "operator_panel": NODE | {"scara_description", "cell_recorder"},
    "scara_bringup": NODE,
    "farm": NODE,
}
"""For each room the others that it may import. scara_bringup reaches nodes by rosrun only."""

TOOLS = {"robot_doctor", "fanuc_kit", "what_if", "twin_analysis", "scara_course"}
RINGS: dict[str, set[str]] = {
    "cell": set(ROOMS) - TOOLS - {"farm"},
    "tools": TOOLS,
    "farm": {"farm"},
}
"""The cell needs neither tools nor farm; tools stand on the cell; the farm on messages alone."""
REACH: dict[str, set[str]] = {
    "cell": RINGS["cell"],
    "tools": RINGS["cell"] | RINGS["tools"],
    "farm": NODE | RINGS["farm"],
}
"""The rooms that a ring's rooms may use: what is built when a ring is built alone."""

if __name__ == "__main__":
    if len(sys.argv) != 2 or sys.argv[1] not in RINGS:
        sys.exit(f"rooms: name one ring: {', '.join(RINGS)}")
    print("\n".join(sorted(REACH[sys.argv[1]])))
