"""What the pair may not do wherever the lead is: zones, Cartesian speed, distance from people. No certified function."""
