"""Description of the cell: the URDF and the inertia that follows from its shapes."""
