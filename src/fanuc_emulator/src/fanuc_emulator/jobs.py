"""What starts a program: its number, START, a request (RSR) that waited, the pendant."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping

from scara_config.set_up.settings import STREAM_RSR

from fanuc_emulator.tp.executor import Executor, Program, ProgramState
from fanuc_emulator.uop import UopRequest

LONGEST_QUEUE = 8
"""Requests that wait at most [asm]: as many as there are RSR."""


class Jobs:
    """Decide which program starts or goes on; each method returns why it did not, or None.

    Args:
        programs: By number, the stream program among them.
        executor: Runs them, one at a time.
        start_delay: From a start to the first step [s].
        start_for_continue: START starts nothing, it only lets a paused program go on.
        obstacle: Says why nothing may start now, or None.

    Attributes:
        selected: What START starts: the last program that was selected or started.
    """

    def __init__(
        self,
        programs: Mapping[int, Program],
        executor: Executor,
        start_delay: float,
        start_for_continue: bool,
        obstacle: Callable[[], str | None],
    ) -> None:
        self._programs, self._executor, self._delay = programs, executor, start_delay
        self._only_continues, self._obstacle = start_for_continue, obstacle
        self._queue: deque[int] = deque()
        # What was started at the pendant and waits for the end of the stream: until when [ms].
        self._here: tuple[int, int] | None = None
        self.selected: Program | None = None

    def take(
        self, programs: Mapping[int, Program], library: Mapping[str, Program] | None = None
    ) -> None:
        """Have other programs beside the stream from the next start on.

        One that runs ends as it began; one that is selected stays so by its name.

        Args:
            programs: By number.
            library: All that can be called, by name; None: those that have a number.
        """
        if library is None:
            library = {each.name: each for each in programs.values()}
        self._executor.library = library
        stream = self._programs[STREAM_RSR]
        self._programs = {**programs, STREAM_RSR: stream}
        if self.selected is not None:
            named = {each.name: each for each in self._programs.values()}
            self.selected = named.get(self.selected.name)

    @property
    def waits_here(self) -> bool:
        """Whether a start at the pendant waits."""
        return self._here is not None

    @property
    def waiting(self) -> bool:
        """Whether requests wait."""
        return bool(self._queue)

    def ask(self, request: UopRequest, number: int) -> str | None:
        """Do what an input's edge asks for, if that is a start."""
        match request:
            case UopRequest.RUN:
                return self.run(number)
            case UopRequest.QUEUE:
                return self.request(number)
            case UopRequest.SELECT:
                return self.select(number)
            case UopRequest.START:
                return self.start()
            case UopRequest.START_FIRST:
                return self.start_selected()
            case UopRequest.RESUME:
                return self.resume()
        return None

    def run(self, number: int) -> str | None:
        """Start a program at its first line, if none runs or is paused."""
        program = self._programs.get(number)
        executor = self._executor
        if executor.program is not None and executor.state is not ProgramState.ABORTED:
            return f"{executor.program.name} is {executor.state.name.lower()}"
        if program is None:
            return f"RSR{number} has no program"
        return self._begin(program, 0)

    def run_here(self, number: int, until_ms: int) -> str | None:
        """Start a program at the pendant, or let it wait for the end of a stream.

        Args:
            number: Of the program.
            until_ms: It waits no longer than until then, by the robot's own clock.
        """
        program = self._executor.program
        over = program is None or self._executor.state is ProgramState.ABORTED
        if not over and program is not None and program.streams:
            self._here = number, until_ms
            return None
        return self.run(number)

    def next_here(self, now_ms: int) -> str | None:
        """Start what waits for the end of the stream, once that has come or will not soon."""
        if self._here is None:
            return None
        number, until_ms = self._here
        if self._executor.state is not ProgramState.ABORTED and now_ms < until_ms:
            return None
        self._here = None
        return self.run(number)

    def forget_here(self) -> str | None:
        """Forget what waits for the end of the stream: the robot is held. Return why it is gone."""
        gone, self._here = self._here, None
        return None if gone is None else "the robot was held before it began"

    def request(self, number: int) -> str | None:
        """RSR: start a program, or let it wait until the one that runs or is paused has ended."""
        if self._executor.state is ProgramState.ABORTED:
            return self.run(number)
        if number not in self._programs:
            return f"RSR{number} has no program"
        if len(self._queue) == LONGEST_QUEUE:
            return f"{LONGEST_QUEUE} requests wait already"
        self._queue.append(number)
        return None

    def next(self) -> str | None:
        """Start the request that has waited longest, if one waits and no program is in its way."""
        if self._queue and self._executor.state is ProgramState.ABORTED:
            return self.run(self._queue.popleft())
        return None

    def clear(self) -> None:
        """Forget the requests that wait."""
        self._queue.clear()

    def select(self, number: int) -> str | None:
        """PNS: choose what START starts; not while a program runs or waits, and 0 is nothing."""
        if not number or self._executor.state is not ProgramState.ABORTED:
            return None
        if number not in self._programs:
            return f"PNS{number} has no program"
        self.selected = self._programs[number]
        return None

    def start(self) -> str | None:
        """START: let a paused program go on; else start the selected one, where that is set."""
        if self._executor.state is ProgramState.PAUSED:
            return self.resume()
        if self._only_continues:
            return None
        # The cursor is a line of the program that ran last, and means nothing in another one.
        ended = self.selected is self._executor.program
        return self.start_selected(self._executor.cursor if ended else 0)

    def start_selected(self, index: int = 0) -> str | None:
        """Start the selected program at a step; not while a program runs or waits."""
        if self._executor.state is not ProgramState.ABORTED:
            return None
        if self.selected is None:
            return "no program is selected"
        return self._begin(self.selected, index)

    def resume(self) -> str | None:
        """Let a paused program go on."""
        if self._executor.state is not ProgramState.PAUSED:
            return None
        reason = self._obstacle()
        if reason is None:
            self._executor.resume()
        return reason

    def _begin(self, program: Program, index: int) -> str | None:
        reason = self._obstacle()
        if reason is None:
            self.selected = program
            self._executor.start(program, self._delay, index)
        return reason
