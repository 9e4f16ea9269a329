"""Play scenes of a storm in a live cell, lead it back to IDLE, and judge what happened."""

from __future__ import annotations

import contextlib
import math
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor, wait
from dataclasses import dataclass, replace
from typing import Any

import websocket
from fanuc_emulator.pendant.pendant_link_io import PendantError
from scara_ros.services.service_connection_io import ServiceError
from websockets.exceptions import WebSocketException

from harness.faults.rows import Row
from harness.running.repeats import NOTES
from harness.starter import way_out
from harness.storm.crew import Crew
from harness.storm.deeds import DEEDS
from harness.storm.hands import Attempt
from harness.storm.names import KINDS, READY_S
from harness.storm.rules.effects import EFFECTS
from harness.storm.rules.history import History, Violation
from harness.storm.rules.monitor import NAMES, evidence, judge, stood_still
from harness.storm.scenes import SECONDS, Step, draw, opening

THREADS = 24
RECOVERS_S = 60.0
STEP_S = 0.3
"""Between two commands that lead back to IDLE."""
WATCHED_S = 1.0
"""Whoever were to move at the end of a scene does so within this."""
ENDS_S = 30.0
"""A fault has ended within this."""
FRESH_S = 0.5
AWAY = "lead the real robot away by its pendant"
STORM, MACHINE = "storm", "storm, while the machine itself stood still"
LOST = (
    *(OSError, AssertionError, PendantError, ServiceError),
    *(WebSocketException, websocket.WebSocketException),
)
"""How a deed fails whose door is broken: that is no finding."""


@dataclass(frozen=True)
class Scene:
    """One scene that was played and judged."""

    seed: int
    number: int
    steps: list[Step]
    history: History
    violations: list[Violation]

    @property
    def apart(self) -> list[Violation]:
        """Return what was seen while the machine itself stood still."""
        return [v for v in self.violations if stood_still(self.history, v)]

    def rows(self) -> list[Row]:
        """Return how often each rule was broken; apart, what the machine may have caused."""
        broken = [v.rule for v in self.violations if v not in self.apart]
        excused = [v.rule for v in self.apart]
        rows = [
            Row(STORM, f"{name} [times]", 0.0, float(broken.count(name)), always=True)
            for name in NAMES
        ]
        rows += [
            Row(MACHINE, f"{name} [times]", 0.0, float(excused.count(name)), at_least=True)
            for name in NAMES
            if name in excused
        ]
        return [*rows, *self._effects()]

    def _effects(self) -> list[Row]:
        """Return how often what the scene was played for has happened: at least once each."""
        struck = any(step.name not in KINDS for step in self.steps)
        played = {"any", opening(self.seed, self.number), *(["struck"] if struck else [])}
        return [
            Row(
                STORM,
                f"{effect.name} [times]",
                float(effect.played in played),
                float(effect.count(self.history)),
                at_least=True,
            )
            for effect in EFFECTS
        ]

    def text(self) -> str:
        """Return each violation with its seed, scene and evidence."""
        lines = []
        for violation in self.violations:
            gap = stood_still(self.history, violation)
            machine = f" (the machine stood still for {1e3 * gap:.0f} ms)" if gap else ""
            lines.append(
                f"seed {self.seed}, scene {self.number}: {violation.rule}{machine}:"
                f" {violation.evidence}"
            )
            lines += [f"    {line}" for line in evidence(self.history, violation)]
        return "\n".join(lines)


class Storm:
    """Plays scenes with a crew."""

    def __init__(self, crew: Crew) -> None:
        """Use a crew whose cell is IDLE."""
        self._crew = crew
        self._attempts: list[Attempt] = []
        # Whether the robot stands where the twin cannot come, as the pair has said.
        self._in_the_way = False

    def play(self, seed: int, number: int, seconds: float = SECONDS) -> Scene:
        """Play one scene, lead the pair back to IDLE, and judge all of it."""
        self._attempts.clear()
        self._crew.strikes.forget()
        steps = draw(seed, number, seconds)
        begun, start = time.time(), time.monotonic()
        with ThreadPoolExecutor(THREADS, "storm") as pool:
            running = [self._due(pool, start, step) for step in steps]
            struck = [f for f, step in zip(running, steps) if step.name not in KINDS]
            wait(struck, ENDS_S)
            died = self._crew.start_the_dead()
            unrecovered = self._recover()
        for each in running:
            each.result()  # a deed or fault that has failed itself is no storm
        if not unrecovered:
            self._crew.hands.release_control()
        time.sleep(WATCHED_S)
        history = self._crew.history(
            begun,
            deeds=[deed for a in list(self._attempts) if (deed := a.deed()) is not None],
            strikes=list(self._crew.strikes.done),
            births={side: list(at) for side, at in self._crew.strikes.births.items()},
            deaths=[*died, *self._crew.deaths()],
            unrecovered=unrecovered,
        )
        return Scene(seed, number, steps, history, judge(history))

    def _due(self, pool: ThreadPoolExecutor, start: float, step: Step) -> Future[Any]:
        """Wait until a step is due, and begin it beside the others."""
        time.sleep(max(0.0, start + step.at - time.monotonic()))
        do: Callable[..., Any] = self._do if step.name in KINDS else self._strike
        return pool.submit(do, step.name, *step.arguments)

    def _strike(self, name: str, *arguments: float | str) -> None:
        if name != "halt":
            self._crew.strikes.strike(name, *arguments)
            return
        begins = time.monotonic() + READY_S
        with self._crew.hands.lines_open():
            time.sleep(max(0.0, begins - time.monotonic()))
            self._crew.strikes.strike(name, *arguments)

    def _do(self, name: str, *arguments: float | str) -> Attempt:
        """Do one deed; one whose door is broken is noted as far as it came."""
        attempt = Attempt(name)
        self._attempts.append(attempt)
        if "emulator" in self._crew.strikes.down and name.startswith(("pendant", "press")):
            return attempt  # a robot that stands still would do it long after it was pressed
        with contextlib.suppress(*LOST):
            DEEDS[name](self._crew.hands, attempt, *arguments)
        return attempt

    def _recover(self) -> str:
        """Lead the pair back to IDLE as its operator would; return why that failed, or nothing."""
        cell = self._crew.cell
        cell.modbus.heal()
        cell.web.heal()
        for node in list(cell.processes):
            cell.go_on(node)
        deadline = time.monotonic() + RECOVERS_S
        stopped = math.inf
        while time.monotonic() < deadline:
            if stopped == math.inf and self._released():
                # An idle pair may have a twin whose own side has paused it: it would not move.
                self._do("STOP")
                stopped = time.time()
            if self._led_on(stopped):
                self._do("SPEED", 100.0)
                return ""
            time.sleep(STEP_S)
        if not cell.states:
            return "no state was ever heard"
        last = cell.states[-1]
        age = time.time() - last.header.stamp.to_sec()
        return f"{last.mode}, said {age:.1f} s ago, after {RECOVERS_S:g} s: {last.why}"

    def _released(self) -> bool:
        """Release the buttons at the robot, give it its speed back; return whether that is done."""
        buttons = self._do("release buttons").answered
        return None not in (buttons, self._do("pendant override", 100.0).answered)

    def _led_on(self, since: float) -> bool:
        """Lead on from a mode of ``since`` [s] or later; return whether it is IDLE."""
        cell = self._crew.cell
        newest = cell.states[-1].header.stamp.to_sec() if cell.states else -math.inf
        if newest < max(since, time.time() - FRESH_S):
            return False
        if command := way_out(cell.mode):
            if command == "RESET":
                # A button that the last deed pressed may go down after both were released.
                self._released()
                self._in_the_way = AWAY in cell.states[-1].why
            elif self._in_the_way:
                self._in_the_way = False
                # Where only HOLD stops, the stream is paused: no program starts beside it.
                self._do("pendant abort")
                self._do("pendant program", "2")
            self._do(command)
        return cell.mode == "IDLE"


def scenes(crew: Crew, seed: int, seconds: float, first: int = 0) -> Iterator[Scene]:
    """Play the scenes of a seed one after the other until ``seconds`` are over.

    One with something that the machine may have caused counts as a repeat: the budget of a run
    holds for what is excused too.
    """
    storm, begun, number = Storm(crew), time.monotonic(), first
    while time.monotonic() - begun < seconds:
        scene = storm.play(seed, number)
        if scene.apart:
            rules = ", ".join(dict.fromkeys(violation.rule for violation in scene.apart))
            NOTES.add(f"the machine stood still; seed {seed}, scene {number}: {rules}")
        yield scene
        number += 1


def summed(rows: list[Row]) -> list[Row]:
    """Return the rows with the same name as one: counts and limits are added up."""
    found: dict[tuple[str, str], Row] = {}
    for row in rows:
        key = (row.fault, row.metric)
        limit, more = (found[key].limit, found[key].measured) if key in found else (0.0, 0.0)
        found[key] = replace(row, limit=row.limit + limit, measured=row.measured + more)
    return list(found.values())
