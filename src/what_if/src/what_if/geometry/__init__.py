"""Where bodies are, and how near they come to each other. Pure."""
