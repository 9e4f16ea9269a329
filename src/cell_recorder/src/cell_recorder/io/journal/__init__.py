"""The journal's files. No ROS: whoever reads a journal imports this alone."""

from cell_recorder.io.journal.day_files import DayFiles, JournalError
from cell_recorder.io.journal.reader import journals, read, read_between
from cell_recorder.io.journal.writer import JournalWriter

__all__ = [
    "DayFiles",
    "JournalError",
    "JournalWriter",
    "journals",
    "read",
    "read_between",
]
