"""What is shown of a motion beside its verdict."""
