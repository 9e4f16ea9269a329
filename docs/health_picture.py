"""Draw the picture of docs/operating/health.md.

source env.sh; .venv/bin/python docs/health_picture.py
"""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from fanuc_emulator.plant.config import load_plant
from fanuc_emulator.plant.wear import Wear
from scara_config import load_robot
from twin_analysis.health.signs import signs_of
from twin_analysis.health.trend import WINDOW, Baseline, Monitor
from twin_analysis.health.virtual_cycles import (
    A_DAY,
    WEEK,
    Condition,
    celsius_at,
    grown,
    run_cycle,
)

ROOT = Path(__file__).resolve().parents[1]
FOLDER = ROOT / "config" / "robots" / "fanuc_sr6ia"
SEED, WEAR, LOOKED = 1, Wear("friction", 0.4, "joint_2"), 20


def main() -> None:
    """Run a first week and twenty cycles of wear, and draw joint friction against the limit."""
    robot, random = load_robot(FOLDER), np.random.default_rng(SEED)
    plant = load_plant(robot, FOLDER, f"field:{SEED}")
    joints = robot.joints
    fastest = np.array([joint.velocity for joint in joints])
    ranges = np.array([joint.upper - joint.lower for joint in joints])
    carries = [joint.screw_axis is not None for joint in joints]
    names = [joint.name for joint in joints]
    cycles = []
    for number in range(WEEK + LOOKED):
        wears = (grown(WEAR, number - WEEK),) if number >= WEEK else ()
        now = Condition(celsius_at(number, random), wears)
        cycles.append(signs_of(run_cycle(robot, plant, now, random), fastest))
    base = Baseline(names, ranges, carries, cycles[:WEEK])
    monitor, first = Monitor(base), 0
    for number, signs in enumerate(cycles):
        if number >= WEEK and (found := monitor.take(signs)) is not None:
            first = number
            print(found.text)
            break
    values = 100.0 * np.array([base.changes(signs)["friction"] for signs in cycles])
    worn = names.index(WEAR.joint)
    limit = 100.0 * base.limits()["friction"][worn]
    days = (np.arange(len(cycles)) + 0.5) / A_DAY
    # Small and dense, so that a phone still shows letters that can be read.
    figure, axes = plt.subplots(figsize=(5.0, 3.6), layout="constrained")
    axes.axvspan(0.0, WEEK / A_DAY, color="0.93", zorder=0)
    axes.plot(days, np.delete(values, worn, axis=1), color="0.6", linewidth=0.8)
    axes.plot(days, values[:, worn], color="tab:orange", linewidth=1.0, marker=".", markersize=4)
    means = np.convolve(values[:, worn], np.ones(WINDOW) / WINDOW, mode="valid")
    axes.plot(days[WINDOW - 1 :], means, color="tab:orange", linewidth=2.4)
    axes.axhline(limit, color="0.2", linestyle=":")
    axes.axvline(days[first], color="tab:red", linestyle="--")
    top = axes.get_ylim()[1]
    axes.text(WEEK / A_DAY / 2, 0.93 * top, "first week", ha="center", va="top")
    axes.text(0.1, limit + 0.02 * top, f"limit {limit:.0f} %", color="0.2", va="bottom")
    axes.text(days[first] - 0.1, 0.93 * top, "alarm", color="tab:red", ha="right", va="top")
    axes.text(days[-1] - 0.1, means[-1] - 0.1 * top, "joint_2", color="tab:orange", ha="right")
    axes.text(0.1, -0.2 * top, "grey: the other joints", color="0.4")
    axes.set_xlim(0.0, days[-1])
    axes.set(
        title="Friction of joint_2 grows from day 7 on",
        xlabel="day, six cycles each; bold: mean of the last six",
        ylabel="more friction than in\nthe first week [%]",
    )
    target = ROOT / "docs" / "images" / "health.png"
    figure.savefig(target, dpi=160, metadata={"Software": None})
    print(target)


if __name__ == "__main__":
    main()
