"""``python -m farm.lab``: the same as ``./cell lab``."""

from farm.lab.io.command_line import main

if __name__ == "__main__":
    main()
