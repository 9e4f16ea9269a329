"""What a report says of itself: plant, machine, commit, verdict."""
