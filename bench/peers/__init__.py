"""The other side: libraries that the bench alone installs, in a process of their own."""
