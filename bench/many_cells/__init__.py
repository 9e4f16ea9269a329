"""The farm under load: one part of the table each."""
