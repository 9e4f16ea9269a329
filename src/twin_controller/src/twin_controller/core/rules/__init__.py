"""The state table, and the conditions that its triggers stand for."""
