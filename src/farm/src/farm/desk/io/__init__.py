"""The desk on the bus, on the disk, on the page and in the terminal."""
