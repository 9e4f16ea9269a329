"""A whole cell in virtual time: real core, stand-in, simulator and motion nodes.

There is no process, no socket, no thread and no sleep; see :mod:`harness.virtual_cell.cell`. With
the cells of processes it shares the files and the choice of a robot, the configuration of a known
robot and the commands that lead a pair on (:mod:`harness.starter`). Nodes and wires are its own.
"""
