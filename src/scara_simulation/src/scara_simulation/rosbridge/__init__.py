"""rosbridge v2 without I/O: packets, one client's session, its waiting messages, message conversion."""
