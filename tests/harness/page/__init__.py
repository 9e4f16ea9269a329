"""The operator's page without a cell: scenes that a test chooses, in place of robots."""
