"""What the page lets an operator do, and when; pure."""
