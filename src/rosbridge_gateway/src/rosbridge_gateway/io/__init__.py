"""What touches the world: sockets, threads, service connections."""
