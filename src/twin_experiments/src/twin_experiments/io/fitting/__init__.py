"""The simulation in the loop of a fit, and what it reads from a bag."""
