"""Two runs, or a run and what was expected, side by side."""
