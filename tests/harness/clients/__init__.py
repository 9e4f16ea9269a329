"""Other people's programs: where they are installed, what they meet, what they have found."""
