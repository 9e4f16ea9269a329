"""Checks of a robot profile by the article's methodology: robot, simulation, registers, links."""
