"""The figures of README.md: taken from bench/results.json, so that no page contradicts another."""

from __future__ import annotations

import re
import statistics
from collections.abc import Mapping, Sequence
from typing import Any

from bench.demo_tables import EXPERIMENTS
from bench.draw_table import LEADS, SPEEDS, figures, spread

SERIES = "kit_drawn_50"
"""The demo on what a person can type: what README.md tells; the others are in bench/tables.txt."""
REST = ("positioning_percent", "true_percent")
"""At rest counts the larger: with the lengths that the controller is told, and the true ones."""
QUIET = 1.0
"""A load before that is above takes time from what is measured; our choice."""
BLOCK = r"(<!-- {0}: [^>]* -->\n).*?(<!-- end of {0} -->)"


def with_figures(text: str, content: Mapping[str, Any]) -> str:
    """Return the README with its blocks of figures written anew.

    Args:
        text: README.md, with one block of each name between two comments.
        content: As in results.json.

    Raises:
        ValueError: A block is missing, or there are several of one name.
    """
    blocks = {
        "figures": " ".join([demo_sentence(content.get("demos", ())), *drawn_sentence(content)]),
        "first start": start_sentence(content),
    }
    return with_blocks(text, blocks, "README.md")


def with_blocks(text: str, blocks: Mapping[str, str], file: str) -> str:
    """Return a page with the blocks of figures between its comments written anew.

    Args:
        text: The page, with one block of each name between two comments.
        blocks: What each block says, by its name.
        file: The page's name, for the error.

    Raises:
        ValueError: A block is missing, or there are several of one name.
    """
    for name, said in blocks.items():
        block = re.compile(BLOCK.format(name), re.DOTALL)
        text, count = block.subn(lambda found, said=said: f"{found[1]}{said}\n{found[2]}", text)
        if count != 1:
            raise ValueError(f"{file} has {count} blocks of {name}, expected 1")
    return text


def demo_sentence(series: Sequence[Mapping[str, Any]]) -> str:
    """Tell median and worst of one series, with plant, speed and what it was measured on."""
    demos = next((each for each in series if each["series"] == SERIES), None)
    if demos is None or not demos["runs"]:
        return "No demo ended with a report."
    runs = [run[name] for run in demos["runs"] for name in EXPERIMENTS if name in run]
    path = [run["path_percent"] for run in runs]
    worst = f"worst {max(path):.2f} %"
    quiet = [run["undisturbed_percent"] for run in runs if run.get("undisturbed_percent")]
    if quiet and max(quiet) < max(path):
        worst += f", {max(quiet):.2f} % where the machine did not stand still"
    rest = max(run[key] for run in runs for key in REST if run.get(key) is not None)
    speed = max(run["speed_percent"] for run in runs)
    lost = f" {demos['failed']} more ended without a report." if demos["failed"] else ""
    return (
        f"In {len(demos['runs'])} runs of `./cell demo` at {demos['asked_percent']:g} % on "
        f"{demos['robot']}, {_plant(demos['plant'])}, the tools are at most "
        f"**{statistics.median(path):.2f} % of the reach** apart while moving (median of both "
        f"experiments; {worst}; fastest joint at {speed:.0f} % of its largest "
        f"speed), nothing removed, and {rest:.3f} % at rest. The article: up to "
        f"5 % and 2 %.{lost} {_measured_on(demos)}"
    )


def drawn_sentence(content: Mapping[str, Any]) -> list[str]:
    """Tell median and worst of all drawn robots: one sentence; none where none was measured."""
    measured = content.get("draws")
    if not measured:
        return []
    kinds = list(dict.fromkeys(trial["robot"] for trial in measured["trials"]))
    told = []
    for words, _, _ in LEADS:
        pairs = []
        for speed in SPEEDS:
            found = [
                value
                for robot in kinds
                for value in figures(measured, robot, words, speed, "path_percent")
            ]
            pairs.append(spread(found, " %"))
        told.append(f"{words} {pairs[0]}, at full speed {pairs[1]}")
    return [
        f"In virtual time, {measured['count']} robots drawn of each of {len(kinds)} kinds, each "
        f"number of the field plant within 30 %, median / worst: {'; '.join(told)} "
        f"({measured['date']}, commit {measured['commit']})."
    ]


def start_sentence(content: Mapping[str, Any]) -> str:
    """Tell how long a first start takes, how much it adds to the disk, and how long later ones."""
    told = []
    if first := content.get("first_start"):
        load = first["load_before"]
        beside = f", beside other work (load {load:.1f})" if load > QUIET else ""
        told.append(
            f"The first start sets everything up: {first['setup_s']:.0f} s and "
            f"{first['added_mb'] / 1e3:.1f} GB on a bare Debian 12, with packages from a mirror "
            f"nearby{beside}. {_measured_on(first)}"
        )
    later = {row["id"]: row for row in content.get("rows", ())}.get("start")
    if later is not None and later["ours"] is not None:
        told.append(
            f"Later `./cell up` is ready after {later['ours']:.1f} s. {_measured_on(later)}"
        )
    return " ".join(told) or "How long a start takes was not measured yet."


def _plant(told: str) -> str:
    """Return the plant's name and what it stands for: ``field plant (a field robot, ...)``."""
    name, _, meaning = told.removeprefix("plant ").partition(": ")
    return f"{name} plant ({meaning})" if meaning else f"{name} plant"


def _measured_on(figures: Mapping[str, Any]) -> str:
    machine = ", ".join(figures["machine"].split(", ")[:3])
    return f"Measured {figures['date']}, commit {figures['commit']}, on {machine}."
