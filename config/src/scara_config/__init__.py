"""Every number of the cell as YAML, and the one loader that checks it."""

from scara_config.loader import (
    ConfigError,
    Section,
    config_directory,
    convert,
    load,
    package_folder,
)
from scara_config.profile import description_path, files_in_force, locate
from scara_config.robot import (
    Geometry,
    Joint,
    KeepOut,
    PrismaticJoint,
    RevoluteJoint,
    Robot,
    load_robot,
)

__all__ = [
    "ConfigError",
    "Geometry",
    "Joint",
    "KeepOut",
    "PrismaticJoint",
    "RevoluteJoint",
    "Robot",
    "Section",
    "config_directory",
    "convert",
    "description_path",
    "files_in_force",
    "load",
    "load_robot",
    "locate",
    "package_folder",
]
