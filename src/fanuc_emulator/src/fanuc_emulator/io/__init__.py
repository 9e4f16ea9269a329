"""What touches the world: the Modbus server and the servo loop's thread."""
