"""The line between machines of the lab: who may be at its other end."""
