"""Where the files of a robot are, so that advice names them."""

from __future__ import annotations

import msgspec


class Places(msgspec.Struct, frozen=True):
    """Paths of a robot's files.

    Attributes:
        robot: robot.yaml.
        programs: The folder of its programs.
        urdf: Its URDF.
        body: body.yaml, from which the URDF is written; empty: a person writes the URDF.
    """

    robot: str
    programs: str
    urdf: str
    body: str = ""

    def agree(self, name: str) -> str:
        """Return what makes robot.yaml and URDF say the same.

        Args:
            name: Of the robot.
        """
        if not self.body:
            return f"take the data sheet's value into {self.robot} and {self.urdf}"
        return f"take the data sheet's value into {self.robot}, then: {write_urdf(name)}"


def write_urdf(name: str) -> str:
    """Return the command that writes a robot's URDF from robot.yaml and body.yaml."""
    return f"rosrun scara_description write_urdf {name}"
