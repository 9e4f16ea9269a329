"""What a process asks of the system: memory and turns."""
