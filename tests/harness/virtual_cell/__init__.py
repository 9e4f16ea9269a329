"""A whole cell in virtual time: real core, stand-in, simulator and motion nodes.

There is no process, no socket, no thread and no sleep; see :mod:`harness.virtual_cell.cell`.
"""
