"""A motion that the second world has judged, as the page shows it."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import msgspec
from scara_ros.gate.permit import Judgement
from scara_ros.page import page_words

from operator_panel.door import Answer
from operator_panel.view import words
from operator_panel.view.snapshot import Snapshot
from scara_msgs.msg import MotionOutcome

TONES = {"OK": "good", "LIMITED": "warn", "REFUSED": "bad"}
REFUSED = "REFUSED"
"""As in scara_msgs/JudgeMotion."""
NOT_JUDGED = "Not judged: "
MM = 1e3
JUDGE = "what_if: judge"
"""The name of the judge's status in /diagnostics, behind the cell's."""
SIGN_OF_LIFE_S = 3.0
"""A judge that has said nothing for so long does not run; our choice: three of its periods."""
NO_JUDGE = "No judge runs to preview a motion. To start one: source env.sh; rosrun what_if what_if"


class Judged(msgspec.Struct, frozen=True):
    """What the browser gets.

    Attributes:
        title: The motion in words.
        tone: CSS class of the verdict: good, warn or bad.
        sentence: The verdict in one sentence, or why there is none.
        at: When what stands against it happens [s]; None if nothing does.
        times: [s] from its beginning; empty if there is nothing to play.
        pose: For each joint its positions at these times [rad] or [m].
        clearance: Between the two nearest bodies then [mm]; None where nothing moves.
        speed: Of the tool then [mm/s].
    """

    title: str
    tone: str
    sentence: str
    at: float | None = None
    times: tuple[float, ...] = ()
    pose: dict[str, tuple[float, ...]] = {}
    clearance: tuple[float | None, ...] = ()
    speed: tuple[float, ...] = ()

    @property
    def is_judged(self) -> bool:
        """Whether there is a verdict."""
        return not self.sentence.startswith(NOT_JUDGED)

    @property
    def is_refused(self) -> bool:
        """Whether it must not be made."""
        return self.sentence.startswith(REFUSED)


def judged(title: str, answer: Answer) -> Judged:
    """Return what the page shows of an answer of the second world.

    Args:
        title: The motion in words.
        answer: With the fields of scara_msgs/JudgeMotion as values, if it was judged.
    """
    if not answer.success:
        return Judged(title, "warn", f"{NOT_JUDGED}{answer.message}")
    values = answer.values
    count = len(values["sample_times"])
    joints: Sequence[str] = values["joint"]
    columns = [iter(values["sample_positions"])] * len(joints)
    rows = list(itertools.islice(zip(*columns), count)) if count else []
    return Judged(
        title,
        TONES.get(values["verdict"], "warn"),
        sentence_of(answer),
        round(values["time"], 3) if values["cause"] else None,
        tuple(round(value, 3) for value in values["sample_times"]),
        {name: tuple(round(row[k], 5) for row in rows) for k, name in enumerate(joints)},
        tuple(
            round(MM * value, 1) if value >= 0.0 else None for value in values["sample_clearance"]
        ),
        tuple(round(MM * value, 1) for value in values["sample_speed"]),
    )


def sentence_of(answer: Answer) -> str:
    """Return a verdict in one sentence: why not, when and where, or how long and how near."""
    values = answer.values
    if values["cause"]:
        found = values["place"]
        place = (MM * found[0], MM * found[1], MM * found[2]) if any(found) else None
        told = Judgement(values["verdict"] == REFUSED, answer.message, values["cause"], place)
        return page_words.people(told.text)
    text, between = answer.message, values["clearance_between"]
    # Nothing is said of a motion in which nothing moves against anything.
    if values["clearance"] >= 0.0 and len(between) == 2:
        # As measured where it is smallest; between two looks bodies may be a little nearer.
        distance = MM * values["clearance"]
        shown = words.number(distance, 1 if distance < 10.0 else 0)
        text += f", nearest {shown} mm between {' and '.join(between)}"
    return page_words.people(text)


def made_text(snapshot: Snapshot) -> str:
    """Return how well the last motion was predicted; empty: none was judged and has ended."""
    made = snapshot.made
    if made is None:
        return ""
    if made.end != MotionOutcome.REACHED:
        return f"Last motion: {made.end}, so nothing to compare."
    took, said = (words.number(value, 2) for value in (made.time_measured, made.time_predicted))
    text = f"Last motion: {took} s, predicted {said} s"
    if made.time_predicted <= 0.0:
        return f"{text}."
    off = 100.0 * (made.time_measured / made.time_predicted - 1.0)
    return f"{text} ({words.number(off, 1, signed=True)} %)."


def preview_refusal(snapshot: Snapshot, now: float) -> str:
    """Return why no motion can be previewed now, and what to do; empty: it can.

    Args:
        snapshot: What is known.
        now: Monotonic time [s].
    """
    runs = any(
        now - found.received < SIGN_OF_LIFE_S
        for found in snapshot.diagnoses.values()
        if found.name.endswith(JUDGE)
    )
    return "" if runs else NO_JUDGE


def gate_text(snapshot: Snapshot, now: float) -> tuple[str, str]:
    """Return what the gate does with a motion now, and the tone of it.

    Args:
        snapshot: What is known.
        now: Monotonic time [s].
    """
    gate, moves_unjudged = snapshot.gate, snapshot.moves_unjudged
    judge_runs = not preview_refusal(snapshot, now)
    if gate == "off":
        return "Gate off: no motion is judged before it begins.", "warn"
    if not judge_runs and (moves_unjudged or gate == "warn"):
        return "No judge runs: motions begin unjudged.", "warn"
    if not judge_runs:
        return "No judge runs: no motion may begin.", "bad"
    if gate == "warn":
        return "Judge runs. Gate warns: what is REFUSED begins all the same.", "warn"
    return "Judge runs. Gate on: what is REFUSED does not begin.", "good"
