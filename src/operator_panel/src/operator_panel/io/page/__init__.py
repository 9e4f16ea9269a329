"""The parts of the page, built with nicegui."""
