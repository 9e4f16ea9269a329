"""What stands between a file of the configuration and its values."""
