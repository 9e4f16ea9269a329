"""Wires that can be made to fail: damage to units of data, sensor noise, a relay in a process of its own."""
