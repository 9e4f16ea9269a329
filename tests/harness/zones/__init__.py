"""Random moves beside random zones, judged by the ground truth of both sides alone."""
