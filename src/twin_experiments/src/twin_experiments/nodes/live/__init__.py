"""A running twin as the commands see it: what they send, what they wait for."""
