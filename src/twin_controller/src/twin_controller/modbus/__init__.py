"""The pure half of the Modbus protocol: words, blocks of registers, numbered commands."""
