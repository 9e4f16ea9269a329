"""``python -m farm``: the same as ``./cell farm``."""

from farm.desk.io.command_line import main

if __name__ == "__main__":
    main()
