"""The joints' control loops: one joint's, all of them, their models, and their steps in C."""
