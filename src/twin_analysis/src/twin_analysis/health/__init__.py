"""Does a robot wear out? What its set points, positions and torques say, day by day."""
