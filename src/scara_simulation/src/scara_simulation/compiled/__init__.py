"""The joint loops' steps in C, beside the Python that says what is right."""
