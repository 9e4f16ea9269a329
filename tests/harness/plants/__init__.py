"""The article's experiments on robots that were made different, in virtual time."""
