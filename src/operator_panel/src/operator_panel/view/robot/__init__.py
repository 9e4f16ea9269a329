"""The real robot in words: its programs, its state, its registers."""
