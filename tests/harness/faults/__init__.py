"""A cell that can be broken, what is done to it, and what is measured."""
