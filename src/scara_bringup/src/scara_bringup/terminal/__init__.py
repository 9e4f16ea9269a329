"""What a person at the terminal sees: messages, addresses, a browser."""
