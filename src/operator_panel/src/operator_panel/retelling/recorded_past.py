"""A recording on the page's time line; pure."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections import deque
from functools import partial
from itertools import islice

import msgspec

from operator_panel.retelling.lines import Happened, Head, Line, Parts, Told, snapshot_of
from operator_panel.view.events import Event
from operator_panel.view.frame import Frame, FrameMaker, Points
from operator_panel.view.past import Look, Past, PastMoment
from operator_panel.view.snapshot import Part

EVENTS_KEPT = 5_000  # our choice: some hundred an hour; the oldest go first
EVENTS_SHOWN = 100  # our choice: what goes with each moment to a page


class RecordedLook(Look, frozen=True):
    """A moment of a recording as a page gets it.

    Attributes:
        run: Name of the recording.
        ends: Time of its last message [s].
        events: The newest up to the moment, newest first.
        note: What must be said of the moment; empty: nothing.
    """

    run: str
    ends: float
    events: list[Event]
    note: str


class RecordedPast:
    """Takes the lines of a recording; what was told already can be looked at. Not thread-safe."""

    def __init__(self, run: str, maker: FrameMaker) -> None:
        """Know nothing yet of the recording ``run``."""
        self.head: Head | None = None
        self._run, self._maker = run, maker
        self._past = Past(math.inf)
        self._parts: dict[str, tuple[Part, ...]] = {}
        self._events: deque[tuple[float, Event]] = deque(maxlen=EVENTS_KEPT)

    def take(self, line: Line) -> None:
        """Take the next line; the first one is the head."""
        match line:
            case Head():
                self.head = line
            case Parts(parts):
                self._parts = parts
            case Told(at) if self.head is not None:
                t = round(at - self.head.first, 3)
                frame, points = partial(self._frame, line, t), partial(self._points, line)
                self._past.keep(PastMoment(at, t, frame, points, self._parts))
            case Happened(at, event):
                self._events.append((at, event))

    def _frame(self, moment: Told, t: float) -> Frame:
        frame = self._maker.make(snapshot_of(moment), moment.at)
        return msgspec.structs.replace(frame, t=t)

    def _points(self, moment: Told) -> Points:
        return self._maker.points(snapshot_of(moment), moment.at)

    def look(self, at: float, window_s: float) -> RecordedLook | None:
        """Return the moment nearest to the system time ``at`` [s]; None: none was told yet.

        Args:
            at: When.
            window_s: So far back the charts look [s].
        """
        found = self._past.look(at, window_s)
        if found is None or self.head is None:
            return None
        # The newest events up to then, newest first.
        end = bisect_right(self._events, found.at, key=lambda row: row[0])
        shown = islice(self._events, max(0, end - EVENTS_SHOWN), end)
        return RecordedLook(
            **msgspec.structs.asdict(found),
            run=self._run,
            ends=self.head.last,
            events=[event for _, event in shown][::-1],
            note=found.frame.silent,
        )
