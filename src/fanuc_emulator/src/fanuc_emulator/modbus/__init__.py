"""The robot's Modbus server."""
