"""What a cell with a name finds by itself: its ports, its turn, and whether there is room."""
