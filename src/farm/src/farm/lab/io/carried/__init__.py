"""What travels between machines of the lab beside words: files, and which version they have."""
