"""What a recording says, told again as the page has shown it."""
