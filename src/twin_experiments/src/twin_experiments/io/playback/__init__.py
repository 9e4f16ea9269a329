"""A recorded robot in front of a live twin."""
