"""The second world: a motion is tried here before steel moves.

``judge(world, motion)`` answers for a motion what would come of it. Nothing here writes to a wire.

What it is made of:

``world``     a frozen snapshot of the cell: joints, part in hand, parts, payload, people, zones,
              obstacles, speed caps, the robot's identified lag and its spread.
``motions``   what can be asked for: a point of the tool, joint positions, a trajectory over some
              joints, a program of config/programs, the way that a bag holds.
``timing``    the motion as legs with times: who moves when, how fast, with which effort.
``geometry``  where all bodies are, and how near they come. Nothing slips between two samples: the
              proof stands in :mod:`what_if.geometry.sweep`.
``handling``  what the gripper takes, sets down or drops on the way.
``judging``   puts these together and finds the first reason, in time, against the motion.
``verdict``   the answer: OK, LIMITED or REFUSED, and the figures.

``io`` reads the cell's files and bags, ``nodes`` has the command line and the service.
"""
