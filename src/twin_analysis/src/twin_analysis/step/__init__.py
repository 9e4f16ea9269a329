"""Steps of single joints and their measures."""
