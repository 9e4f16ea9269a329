"""Put both robots' descriptions where robot_state_publisher and RViz look for them.

``robot_description`` is the twin, ``real/robot_description`` the real robot's ghost. `cell up` does this by itself.

Usage: rosrun scara_bringup set_descriptions [FILE]; without FILE the URDF of the chosen robot.
"""

from __future__ import annotations

import sys
from pathlib import Path

import rosgraph
from scara_config import ConfigError, load_robot
from scara_description.ghost import DescriptionError, ghost_of

from scara_bringup.plan import REAL_DESCRIPTION

CALLER = "set_descriptions"


def main() -> None:
    """Set both parameters; say what was wrong otherwise."""
    words = [word for word in sys.argv[1:] if ":=" not in word]
    if len(words) > 1:
        sys.exit("usage: set_descriptions [FILE]")
    try:
        path = Path(words[0]) if words else load_robot().description
        text = path.read_text(encoding="utf-8")
        both = {"robot_description": text, REAL_DESCRIPTION: ghost_of(text)}
        master = rosgraph.Master(f"/{CALLER}")
        for name, value in both.items():
            master.setParam(rosgraph.names.resolve_name(name, rosgraph.names.get_ros_namespace() + CALLER), value)
    except (ConfigError, DescriptionError, rosgraph.MasterError) as error:
        sys.exit(f"{CALLER}: {error}")
    except OSError as error:
        sys.exit(f"{CALLER}: {error.filename or rosgraph.get_master_uri()}: {error.strerror}")
