"""What the pair may not do, whoever leads: zones, speed, distance from people. Not certified."""
