"""The pure half of the link to the twin: packets, commands, and what a reading has to pass."""
