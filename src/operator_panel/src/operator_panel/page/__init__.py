"""The parts of the page, built with nicegui, and what it serves beside."""
