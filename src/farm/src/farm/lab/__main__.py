"""``python -m farm.lab``: the same as ``./cell lab``."""

from farm.lab.command_line_io import main

if __name__ == "__main__":
    main()
