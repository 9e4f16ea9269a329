"""The parts of ``./cell bench --what-if``."""
