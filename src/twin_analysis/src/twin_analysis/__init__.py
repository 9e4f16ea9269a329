"""Runs are looked at again: compared, replayed, fitted; steps are measured."""
