"""The files of the site's authority, and of a machine that has joined."""
