"""Wires that can be made to fail.

Damage to units of data, sensor noise, a relay in a process of its own.
"""
