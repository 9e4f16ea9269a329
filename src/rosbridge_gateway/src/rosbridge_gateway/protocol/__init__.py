"""rosbridge v2 without I/O.

Packets, one client's session, its waiting messages, message conversion.
"""
