"""From what the cell says to what is shown; pure."""
