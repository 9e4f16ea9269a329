"""Checks of a robot profile, as the article's methodology asks: robot, simulation, registers, links."""
