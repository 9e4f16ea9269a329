"""Run the same motion of the simulated cell and print the hash of all its states.

``python -m bench.world.repeat``.
"""

from __future__ import annotations

import hashlib
import struct

from scara_config import load_robot

from bench.world.offline import offline_twin

TARGETS = ((0.0, 1.0), (0.0, 1.2), (-0.16, -0.1), (0.0, 1.5))
"""Two poses of the twin's joints [rad], joint_3 [m]; the arm is free there."""
MOVES, STEPS = 20, 1000


def main() -> None:
    """Move there and back."""
    robot, found = load_robot(), hashlib.sha256()
    with offline_twin(robot) as (_, simulation):
        for move in range(MOVES):
            for joint, pair in zip(robot.twin_joints, TARGETS):
                simulation.control.command_position(joint.name, pair[1 - move % 2])
            for snapshot in simulation.advance(STEPS):
                values = (*snapshot.positions, *snapshot.velocities, *snapshot.efforts)
                found.update(struct.pack(f"<{len(values)}d", *values))
    print(found.hexdigest())


if __name__ == "__main__":
    main()
