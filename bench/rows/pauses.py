"""Rows of a machine that stands still now and then.

pause_twin_leads and pause_real_leads in virtual time, so that the pauses of this machine are not
measured with those of the row; stopped_twin_leads with a whole cell.
"""

from __future__ import annotations

import statistics
from random import Random

from harness.plants.trials import run_trial
from harness.plants.variants import IDEAL, Variant

from bench.cells.cell_run import run_experiments, running_cell
from bench.cells.stopped import LENGTHS, Stops, while_it_moved
from bench.cells.whole_cell import process_id
from bench.record import Beside, Goal, Record
from bench.room import Room

ROBOT, SPEED_PERCENT = "fanuc_sr6ia", 100.0
ARTICLE = Goal("ours", 5.0)
"""The article's path error [percent of reach]."""
UNSEEN = Goal("ratio", 1.2)
"""A robot that has its set points ahead of their time goes on by them; our choice."""
STOPPED = Goal("ratio", 1.5)
"""Of a live cell, whose rounds lie apart by themselves."""
REPEATS = 5
SHORT_MS, LONG_MS = 20, 50
PHASES_S = (0.9, 1.1, 1.3)
"""When the first pause begins: another part of the motion each time."""


def pause_twin_leads(room: Room) -> Record:
    """The controller stands still while the robot follows the twin."""
    return _paused(room, "pause_twin_leads", "twin_leads", (ARTICLE, UNSEEN))


def pause_real_leads(room: Room) -> Record:
    """The controller stands still while the twin follows the robot."""
    return _paused(room, "pause_real_leads", "real_leads", (ARTICLE,))


def stopped_twin_leads(room: Room) -> Record:
    """The controller of a whole cell is stopped (SIGSTOP) while the twin leads at full speed."""
    folder = room.place("stopped_twin_leads")
    hit: list[float] = []
    errors: list[float] = []
    ended: list[str] = []
    with running_cell(folder, {}) as cell:
        # It raises the robot's override, which is 10 % at power-up and would cap the twin.
        run_experiments(cell, folder / "before", "real_leads", repeat=1)
        room.say("without stops")
        outcome = run_experiments(cell, folder / "calm", "twin_leads", repeat=REPEATS)
        calm = [entry["path_error_max_percent"] for entry in outcome.entries]
        rng = Random(1)
        while len(hit) < LENGTHS:
            room.say(f"{len(hit)} of {LENGTHS} stops")
            with Stops(process_id(cell, "twin_controller"), rng) as stops:
                place = folder / f"stopped_after_{len(errors)}"
                outcome = run_experiments(cell, place, "twin_leads", repeat=REPEATS)
            found, speed = while_it_moved(outcome.bag, room.robot, stops.done)
            if not found:
                raise RuntimeError(f"{place}: none of {len(stops.done)} stops came in a move")
            hit += found
            ended += outcome.ended
            errors += [entry["path_error_max_percent"] for entry in outcome.entries]
    return Record(
        "stopped_twin_leads",
        max(errors),
        max(calm),
        "% of reach",
        (ARTICLE, STOPPED),
        measured="largest distance of both tools at the same instant, the twin leads the article's "
        f"visits, 100 % asked for ({100.0 * speed:.0f} % of the fastest joint's largest), plant "
        "ideal, live; SIGSTOP of twin_controller",
        against=f"the same without stops, {REPEATS} runs",
        statistic="largest",
        rounds=len(errors),
        spread_percent=100.0 * (max(errors) - min(errors)) / statistics.median(errors),
        beside=(
            Beside("stops while the twin moved", float(len(hit)), ""),
            Beside("the longest of them", 1e3 * max(hit), "ms"),
            Beside("runs that ended without a report", len(ended), "", "<= 0", not ended),
        ),
        note="; ".join(ended)[:300],
    )


def _paused(room: Room, name: str, leader: str, goals: tuple[Goal, ...]) -> Record:
    """Compare the path error with pauses each second with that of a controller without any."""
    room.say("without pauses")
    calm = _error(leader, IDEAL)
    errors = {}
    for length in (SHORT_MS, LONG_MS):
        room.say(f"pauses of {length} ms")
        errors[length] = [_error(leader, _pauses(length, phase)) for phase in PHASES_S]
    long, short = (sorted(errors[length]) for length in (LONG_MS, SHORT_MS))
    return Record(
        name,
        long[-1],
        calm,
        "% of reach",
        goals,
        measured=f"largest distance of both tools at the same instant, {leader.replace('_', ' ')}, "
        f"long moves at full speed, plant ideal, virtual time; the twin controller stands still "
        f"for {LONG_MS} ms each second",
        against="the same without pauses",
        statistic="largest",
        rounds=len(PHASES_S),
        spread_percent=100.0 * (long[-1] - long[0]) / statistics.median(long),
        beside=(
            Beside(
                f"with pauses of {SHORT_MS} ms",
                short[-1],
                "% of reach",
                f"<= {ARTICLE.limit:g}",
                ARTICLE.holds(short[-1], None),
            ),
        ),
        note="each round begins the pauses at another part of the motion",
    )


def _pauses(length_ms: int, first_s: float) -> Variant:
    return Variant(
        f"pauses of {length_ms} ms from {first_s:g} s",
        IDEAL.change,
        IDEAL.plant,
        pauses=(length_ms * 1e-3,),
        first_pause=first_s,
    )


def _error(leader: str, variant: Variant) -> float:
    """Return the path error [percent of reach].

    Raises:
        RuntimeError: The experiment ended; the text says why.
    """
    trial = run_trial(ROBOT, variant, leader, SPEED_PERCENT)
    if trial.path_percent is None:
        raise RuntimeError(f"{variant.name}: {trial.ended}")
    return trial.path_percent
