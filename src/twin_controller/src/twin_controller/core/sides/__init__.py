"""What each side says and what that means: link, clock, samples, changes, echoes, gripper."""
