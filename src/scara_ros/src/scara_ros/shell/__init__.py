"""One shell for commands and one for nodes: words, exit codes, errors in one line."""
