"""The robot's own programs as text (``.LS``): what stands there, read and printed."""
