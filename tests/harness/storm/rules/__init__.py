"""The storm's monitor: rules over plain data, which share no code with what they judge."""
