"""A motion before it is made: judged in the second world, and played in the picture."""
