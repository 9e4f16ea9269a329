"""How a node starts, registers, guards itself and ends."""
