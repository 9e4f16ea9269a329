"""rosbridge v2 without I/O.

It holds packets, one client's session, its waiting messages and message conversion.
"""
