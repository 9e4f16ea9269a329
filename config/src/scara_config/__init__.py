"""Every number of the cell as YAML, and the one loader that checks it."""

from scara_config.loader import ConfigError, config_directory, convert, load
from scara_config.robot import Geometry, Joint, PrismaticJoint, RevoluteJoint, Robot, load_robot

__all__ = [
    "ConfigError",
    "Geometry",
    "Joint",
    "PrismaticJoint",
    "RevoluteJoint",
    "Robot",
    "config_directory",
    "convert",
    "load",
    "load_robot",
]
