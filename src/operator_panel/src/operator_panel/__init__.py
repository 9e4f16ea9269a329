"""The operator's page: what both robots do, in words and in one picture, and the operator's commands."""
