"""Stand-in of the real robot: R-30iB Modbus server, servo model, programs, pendant."""
