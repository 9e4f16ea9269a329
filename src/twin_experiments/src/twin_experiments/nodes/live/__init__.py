"""What a command sees of a live cell."""
