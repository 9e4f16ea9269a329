"""The twin's servo model is fitted to a recording."""
