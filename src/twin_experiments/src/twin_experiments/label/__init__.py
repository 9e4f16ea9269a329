"""What a figure was made with, and what it says in one sentence."""
