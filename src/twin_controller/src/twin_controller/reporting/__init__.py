"""What others are told of the controller: its state for replay, the pair's shadow, the robot's status."""
