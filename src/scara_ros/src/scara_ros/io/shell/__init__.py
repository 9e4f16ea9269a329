"""The shells of commands and nodes."""
