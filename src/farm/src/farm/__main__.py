"""``python -m farm``: the same as ``./cell farm``."""

# They add their words to the application.
import farm.desk.lines.alarms_io
import farm.desk.lines.comparing_io
import farm.desk.lines.key_figures_io
import farm.desk.lines.machines_io
import farm.desk.lines.recordings_io
import farm.desk.lines.rollout_io  # noqa: F401
from farm.desk.command_line_io import app


def main() -> None:
    """Run the command line; one whose output nobody reads any longer ends without a word."""
    app(prog_name="./cell farm")


if __name__ == "__main__":
    main()
