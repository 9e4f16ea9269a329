"""How text files are read and written."""
