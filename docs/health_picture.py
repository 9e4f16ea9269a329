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
from twin_analysis.health.trend import Baseline, Monitor
from twin_analysis.health.virtual_cycles import WEEK, Condition, celsius_at, grown, run_cycle

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
        worn = (grown(WEAR, number - WEEK),) if number >= WEEK else ()
        now = Condition(celsius_at(number, random), worn)
        cycles.append(signs_of(run_cycle(robot, plant, now, random), fastest))
    base = Baseline(names, ranges, carries, cycles[:WEEK])
    monitor, first = Monitor(base), 0
    for number, signs in enumerate(cycles):
        if number >= WEEK and (found := monitor.take(signs)) is not None:
            first = number
            print(found.text)
            break
    figure, axes = plt.subplots(figsize=(7.0, 3.2), layout="constrained")
    for k, name in enumerate(names):
        values = [100.0 * base.changes(signs)["friction"][k] for signs in cycles]
        bold = name == WEAR.joint
        axes.plot(values, label=name, linewidth=2.0 if bold else 0.8, zorder=3 if bold else 2)
    axes.axhline(100.0 * base.limits()["friction"][1], color="0.3", linestyle=":", label="limit")
    axes.axvline(WEEK - 0.5, color="0.6")
    axes.text(WEEK - 1.0, axes.get_ylim()[1] * 0.9, "first week", ha="right", color="0.3")
    axes.axvline(first, color="tab:red", linestyle="--", label="alarm")
    axes.set(
        xlabel="cycle, six a day", ylabel="friction against the\nfirst week [%], others' taken off"
    )
    axes.legend(fontsize="small", ncols=2, loc="upper left")
    target = ROOT / "docs" / "images" / "health.png"
    figure.savefig(target, dpi=110, metadata={"Software": None})
    print(target)


if __name__ == "__main__":
    main()
