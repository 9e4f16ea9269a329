"""The doctor's instruments: files, the robot's Modbus server, the twin's web socket."""
