"""What people and programs ask of the pair, and who is let in."""
