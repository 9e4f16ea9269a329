"""What touches the network: questions to the master, connections to services."""
