"""The operator's commands: which are allowed, and who may give them."""
