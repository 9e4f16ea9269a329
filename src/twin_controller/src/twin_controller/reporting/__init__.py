"""What the controller tells others: its state for replay, the shadow, the robot's status."""
