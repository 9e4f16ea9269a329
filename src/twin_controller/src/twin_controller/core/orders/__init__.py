"""Orders to the sides: each is sent again until it is shown, or given up."""
