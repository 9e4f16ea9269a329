"""The operator's page: what both robots do, in words and pictures, and the commands."""
