"""Set points for the follower: closing gaps, aiming ahead, rejecting and limiting."""
