"""The picture of the cell: robots, what stands around them, views, times gone by."""
