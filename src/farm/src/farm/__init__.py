"""Many cells, one view: a link in each cell, a desk that watches, remembers and stops."""
