"""Who is let in: origins, tokens and guesses, places. No socket, no clock."""
