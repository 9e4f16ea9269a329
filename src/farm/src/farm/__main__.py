"""``python -m farm``: the same as ``./cell farm``."""

import signal

# They add their words to the application.
import farm.desk.io.lines.alarms
import farm.desk.io.lines.comparing
import farm.desk.io.lines.key_figures
import farm.desk.io.lines.machines
import farm.desk.io.lines.recordings
import farm.desk.io.lines.rollout  # noqa: F401
from farm.desk.io.command_line import app


def main() -> None:
    """Run the command line; a closed pipe is no error."""
    signal.signal(signal.SIGPIPE, signal.SIG_DFL)
    app(prog_name="./cell farm")


if __name__ == "__main__":
    main()
