"""A recorded run is measured and told."""
