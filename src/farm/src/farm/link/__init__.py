"""The room in the cell: what the farm sees of it, and which commands it may give."""
