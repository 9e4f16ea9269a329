"""What the desk makes of weeks and months: comparisons, and what was fitted."""
