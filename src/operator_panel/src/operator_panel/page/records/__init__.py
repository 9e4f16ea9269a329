"""Recordings on the page: make them, look at them, keep or delete them."""
