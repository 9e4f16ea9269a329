"""Keep-out zones and the points of the arm that may not enter them. Pure."""
