"""What a desk shows of invented cells at a made time: no bus, and a minute takes no time."""

from __future__ import annotations

from farm.desk.alarms import AlarmBook
from farm.desk.roster import Roster
from farm.desk.wall import Wall, wall_of
from farm.keys import CellName
from farm.link.shown import ShownState, show
from farm.wire import CellState, Event
from msgspec.structs import replace

from bench.synthetic.invented import Invented
from scara_msgs.msg import TwinControllerState as Mode

SITE, MACHINE = "hall", "practice"
SILENT_S = 2.0
TURN_S = 7
"""The made cells are stopped, paused, lost and found in turns of this many seconds."""
STOPS = (Mode.STOPPED, Mode.PAUSED, Mode.ESTOP, Mode.OFFLINE, Mode.TWIN_LEADS)


class MadeFarm:
    """Invented cells that go through all modes, are lost, come back, and raise alarms."""

    def __init__(self, numbers: range, begin: float) -> None:
        """Let cells of these numbers join at a time [s since 1970]."""
        self._cells = [Invented(k, begin) for k in numbers]
        self._shown = [ShownState(1) for _ in numbers]
        self._roster, self._alarms = Roster(SILENT_S), AlarmBook()
        self._events: list[tuple[str, Event]] = []
        self._begin, self.unreadable = begin, 0
        for cell in self._cells:
            self._roster.alive(self._name(cell), begin)

    def _name(self, cell: Invented) -> CellName:
        return CellName(SITE, MACHINE, cell.name)

    def alarm(self, indices: range, text: str, now: float, source: str = "fan") -> None:
        """Raise an alarm in some cells."""
        for k in indices:
            body = {"source": source, "level": "error", "active": True, "text": text}
            event = Event(len(self._events) + 1, now, "alarm", False, f"{source}: {text}", body)
            self._told(str(self._name(self._cells[k])), event)

    def clear(self, indices: range, now: float, source: str = "fan") -> None:
        """Let it go; somebody has looked."""
        for k in indices:
            name = str(self._name(self._cells[k]))
            event = Event(1, now, "alarm", False, "", {"source": source, "active": False})
            self._told(name, event)
            self._alarms.read(self._alarms.acknowledge(f"{name}: {source}", "ann@desk", now))

    def _told(self, name: str, event: Event) -> None:
        self._alarms.told(name, event)
        self._events.append((name, event))

    def at(self, now: float) -> Wall:
        """Return what the page shows; times grow from call to call."""
        turn = int(now - self._begin) // TURN_S
        for k, cell in enumerate(self._cells):
            name, phase = self._name(cell), (k + turn) % 11
            if phase == 0:
                if self._roster.entries[name].alive:
                    self._roster.gone(name, now)
                continue
            if not self._roster.entries[name].alive:
                self._roster.alive(name, now)
            said = cell.pair(now, STOPS[phase - 1] if phase <= len(STOPS) else "")
            self._shown[k], state = show(self._shown[k], self._worded(said, k), remote=False)
            self._roster.shown(name, state, now)
        rows, alarms = self._roster.rows(now), self._alarms.rows(now)
        recent = list(reversed(self._events[-50:]))
        return wall_of(now, rows, alarms, recent, unreadable=self.unreadable)

    def _worded(self, state: CellState, k: int) -> CellState:
        """Make every third reason longer than its place."""
        if k % 3 or state.alarm:
            return state
        return replace(state, why=9 * (state.why + " and "), speed_percent=80.0)
