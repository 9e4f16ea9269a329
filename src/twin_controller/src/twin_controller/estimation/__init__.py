"""What a robot's answers tell of it: no decision, so checks may use it too."""
