"""The link to the real robot over Modbus TCP."""
