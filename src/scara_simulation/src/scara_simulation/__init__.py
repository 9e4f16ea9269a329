"""The twin's world in PyBullet, and its web-socket door."""
