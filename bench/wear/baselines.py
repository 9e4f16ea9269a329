"""What plain classifiers of scikit-learn find, on the cases of the monitor.

They learn from labelled runs: one cycle of a robot's first week, one of now. They are held to runs
of robots that they never saw, and to the robots that the monitor is held to, as means of as many
cycles as it takes.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from rich.console import Console
from scara_config import load_robot
from twin_analysis.health.labelled_runs import HEALTHY, labelled_run
from twin_analysis.health.signs import Array, Signs, signs_of
from twin_analysis.health.trend import CONFIRMED, LEAST, WINDOW, Baseline, Monitor, facts_of
from twin_analysis.health.trials import Named, RobotRecord, Watch, WearScene, judged

from bench.second_world.figure import Figure
from bench.wear.found import FOUND_PERCENT, OURS, ROBOTS, WORKERS, figures, records

SEED = 1
LEARNT, TESTED = range(101, 401), range(401, 521)
"""Runs of the data set. The robots of the bench are those of the first runs."""
WIDEST = 10.0
"""No feature is larger: a ratio of what was next to nothing says no more."""
ALL_RUNS, HEALTHY_RUNS = "runs told rightly", "healthy runs told rightly"


class RunSigns(NamedTuple):
    """A labelled run: what its two cycles say, and its label with the joint."""

    first: Signs
    now: Signs
    label: Named


def measure(robots: int, first: int, console: Console) -> list[Figure]:
    """Return the figures of the monitor and of each classifier.

    Args:
        robots: So many are looked at cycle by cycle.
        first: Seed of the first one.
        console: Hears what was missed.
    """
    learnt, tested = pairs(LEARNT), pairs(TESTED)
    models = trained(learnt)
    seen = records(OURS, robots, first, WearScene())
    rows = [
        *figures("the monitor", [judged(record) for record in seen], console),
        *pair_figures("the monitor", tested, monitor_of_pairs()),
    ]
    for name, model in models.items():
        trials = [judged(record, partial(watch_of, model)) for record in seen]
        found = figures(name, trials, console)
        # Whoever only knows what is usual names neither joint nor kind.
        rows += found if name != ALONE else [found[0], found[2]]
        rows += pair_figures(name, tested, partial(told, model))[: 1 + (name != ALONE)]
    return rows


ALONE = "isolation forest, alarms alone"


def trained(learnt: Sequence[RunSigns]) -> dict[str, Any]:
    """Return the classifiers by name."""
    # Loaded where it is needed: it takes seconds, and who only judges has no classifier.
    from sklearn.ensemble import IsolationForest, RandomForestClassifier
    from sklearn.linear_model import LogisticRegression
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import StandardScaler

    rows = np.array([features(pair.now, [pair.first]) for pair in learnt])
    labels = [" ".join(pair.label) for pair in learnt]
    usual = rows[[pair.label[0] == HEALTHY for pair in learnt]]
    return {
        "random forest": RandomForestClassifier(300, random_state=SEED).fit(rows, labels),
        "logistic regression": make_pipeline(
            StandardScaler(), LogisticRegression(max_iter=5000)
        ).fit(rows, labels),
        ALONE: IsolationForest(contamination=0.05, random_state=SEED).fit(usual),
    }


def features(now: Signs, first: Sequence[Signs]) -> Array:
    """Return by how much each sign of each joint differs from the first cycles' mean."""
    columns = []
    for name in ("forward", "backward", "coulomb", "inertia", "lag", "play", "vacuum_s"):
        before = np.mean([getattr(each, name) for each in first], axis=0)
        change = getattr(now, name) - before
        with np.errstate(divide="ignore", invalid="ignore"):
            columns.append(np.atleast_1d(change if name in ("lag", "play") else change / before))
    found = np.concatenate(columns)
    return np.asarray(np.clip(np.nan_to_num(found, nan=WIDEST), -WIDEST, WIDEST))


def told(model: Any, pair: RunSigns) -> Named:
    """Return what a classifier says of a run."""
    return _named(model.predict([features(pair.now, [pair.first])])[0])


def watch_of(model: Any, record: RobotRecord) -> Watch:
    """Return a monitor that asks a classifier of the mean of the last cycles."""
    kept: deque[Array] = deque(maxlen=WINDOW)
    heard: deque[Named] = deque(maxlen=CONFIRMED)

    def watch(signs: Signs) -> Named | None:
        kept.append(features(signs, record.first))
        if len(kept) < WINDOW:
            return None
        heard.append(_named(model.predict([np.mean(kept, axis=0)])[0]))
        confirmed = len(heard) == CONFIRMED and len(set(heard)) == 1
        return heard[0] if confirmed and heard[0][0] != HEALTHY else None

    return watch


def _named(said: Any) -> Named:
    """Return kind and joint of a label; a forest that knows only the usual says 1 or -1."""
    if said in (1, -1):
        return (HEALTHY if said == 1 else "unusual", "")
    kind, _, joint = str(said).partition(" ")
    return kind, joint


def monitor_of_pairs() -> Callable[[RunSigns], Named]:
    """Return the monitor as it would say of one cycle against one."""
    joints = facts_of(load_robot(ROBOTS / OURS))

    def say(pair: RunSigns) -> Named:
        monitor = Monitor(Baseline(joints, [pair.first] * LEAST))
        said = [monitor.take(pair.now) for _ in range(WINDOW + CONFIRMED)][-1]
        return (said.kind, said.joint) if said is not None else (HEALTHY, "")

    return say


def pair_figures(
    name: str, tested: Sequence[RunSigns], say: Callable[[RunSigns], Named]
) -> list[Figure]:
    """Return how many runs get their label, of the healthy ones and of all."""
    right = [(pair.label[0] == HEALTHY, say(pair) == pair.label) for pair in tested]
    healthy = [good for usual, good in right if usual]
    shares: Mapping[str, float] = {
        HEALTHY_RUNS: 100.0 * float(np.mean(healthy)),
        ALL_RUNS: 100.0 * float(np.mean([good for _, good in right])),
    }
    return [
        Figure(name, "%", FOUND_PERCENT, share, at_least=True, note=note)
        for note, share in shares.items()
    ]


def pairs(numbers: range) -> list[RunSigns]:
    """Return labelled runs as their signs."""
    with ProcessPoolExecutor(WORKERS) as pool:
        return list(pool.map(_pair, numbers, chunksize=8))


def _pair(number: int) -> RunSigns:
    folder = ROBOTS / OURS
    run = labelled_run(number, folder, np.random.default_rng([SEED, number]))
    fastest = np.array([joint.velocity for joint in load_robot(folder).joints])
    first, now = (signs_of(cycle, fastest) for cycle in run.cycles)
    return RunSigns(first, now, (run.label, run.wear.joint if run.wear else ""))
