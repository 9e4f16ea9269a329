"""Words of ./cell farm, by subject."""
