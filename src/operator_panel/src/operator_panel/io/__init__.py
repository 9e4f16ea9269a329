"""What touches the machine: files, processes, the web server and its page."""
