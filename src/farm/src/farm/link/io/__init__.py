"""The link on the bus, and the journal in its files."""
