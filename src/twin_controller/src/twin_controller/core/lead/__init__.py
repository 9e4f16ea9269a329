"""Who leads and why: triggers, the state table, and what its rows do."""
