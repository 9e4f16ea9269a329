"""A motion in time: legs, speeds, efforts. Pure."""
