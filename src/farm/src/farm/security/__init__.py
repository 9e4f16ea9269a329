"""Who may come in from another machine, and what he may send and hear there."""
