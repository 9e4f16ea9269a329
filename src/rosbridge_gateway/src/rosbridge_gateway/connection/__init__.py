"""One client's connection: its words, answers, pace and end."""
