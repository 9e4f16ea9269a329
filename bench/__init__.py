"""Measurements that take long: ``./cell bench``."""
