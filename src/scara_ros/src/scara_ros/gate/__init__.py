"""The gate before each motion: what the second world's judge says of it, and what is done then."""
