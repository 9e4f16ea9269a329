"""A cell with a name: its ports, its turn, its room, its service of the machine."""
