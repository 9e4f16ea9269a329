"""Changing the gains of running loops: what is stable, what is let in, and the way back."""
