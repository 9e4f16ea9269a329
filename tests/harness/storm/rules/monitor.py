"""Judge a scene by all rules.

The monitor knows what both sides really did, what was sent and answered, and what the controller
said. It shares no code with the controller's core: its kinematics are the closed form of the tests.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

from harness.storm.rules.history import History, Violation
from harness.storm.rules.limits import above_eighty, beyond_limits
from harness.storm.rules.pair import (
    apart_while_idle,
    dead_node,
    not_idle_again,
    stranger_commands,
    two_leaders,
    without_author,
)
from harness.storm.rules.reading import lives, motions
from harness.storm.rules.stalls import replayed
from harness.storm.rules.stops import (
    REFUSED,
    UNANSWERED,
    moves_after_stop,
    moves_by_itself,
    stop_not_taken,
)

Rule = Callable[[History], Iterator[Violation]]
RULES: tuple[Rule, ...] = (
    moves_after_stop,
    moves_by_itself,
    stop_not_taken,
    replayed,
    beyond_limits,
    above_eighty,
    two_leaders,
    apart_while_idle,
    without_author,
    stranger_commands,
    not_idle_again,
    dead_node,
)
NAMES = (
    "moves after an acknowledged stop",
    "moves by itself",
    REFUSED,
    UNANSWERED,
    "a request from before a stop is done behind a stall",
    "a joint beyond its range",
    "a joint beyond its speed",
    "the robot above 80 % while it follows",
    "two leaders",
    "apart while IDLE",
    "a motion without an author",
    "a stranger commands beside the holder",
    "not IDLE again",
    "a node has died",
)
"""What the rules call their violations."""
TIMELESS = (
    REFUSED,
    "a joint beyond its range",
    "a stranger commands beside the holder",
    "not IDLE again",
    "a node has died",
)
"""Rules that judge no times: no late machine breaks them."""
STOOD_S = 0.03
"""A machine that stood still for longer than this may be the cause."""
LEAD_S = 0.5
"""So long before a violation its cause may lie."""
SHOWN_S = 2.0
"""So much of the scene before and after a violation is evidence."""


def judge(history: History) -> list[Violation]:
    """Return all violations of a scene, in the order of their begin."""
    found = [violation for rule in RULES for violation in rule(history)]
    return sorted(found, key=lambda violation: violation.begin)


def stood_still(history: History, violation: Violation) -> float:
    """Return for how long the machine itself stood still around a violation [s], 0 if not.

    Only what is about times is excused by it.
    """
    if violation.rule in TIMELESS:
        return 0.0
    gaps = [
        end - begin
        for begin, end in history.gaps
        if end > violation.begin - LEAD_S and begin < violation.end
    ]
    longest = max(gaps, default=0.0)
    return longest if longest > STOOD_S else 0.0


def evidence(history: History, violation: Violation) -> list[str]:
    """Return what was sent and decided around a violation, and where both were, as lines."""
    lines = _done(history)
    for at in (violation.begin, violation.end):
        lines += [(at, f"position  {_pose(history, side, at)}") for side in history.truth]
    return _shown(history, lines, violation.begin - SHOWN_S, violation.end + SHOWN_S)


def timeline(history: History) -> list[str]:
    """Return what was sent, decided and moved in a whole scene, as lines."""
    lines = _done(history)
    for side in history.truth:
        for life in lives(history, side):
            for motion in motions(life, history.joints):
                text = f"moves     {side}: {motion.joint} {motion.way:.2f} deg or mm"
                lines.append((motion.begin, f"{text} in {motion.end - motion.begin:.2f} s"))
    lines += [
        (begin, f"machine   stood still for {end - begin:.3f} s") for begin, end in history.gaps
    ]
    return _shown(history, lines, history.begun, history.ended)


def _done(history: History) -> list[tuple[float, str]]:
    """Return when what was sent, answered, broken and decided."""
    lines: list[tuple[float, str]] = []
    for deed in history.deeds:
        lines.append((deed.sent, f"sent      {deed.name} ({deed.kind})"))
        if deed.answered is not None:
            answer = "yes" if deed.success else "no"
            lines.append((deed.answered, f"answered  {deed.name}: {answer}, {deed.said}"))
    for strike in history.strikes:
        lines.append((strike.begun, f"fault     {strike.name}"))
        lines.append((strike.ended, f"over      {strike.name}"))
    for d in history.decisions:
        lines.append((d.at, f"decided   {d.before} + {d.event} -> {d.after}: {d.why}"))
    return lines


def _shown(history: History, lines: list[tuple[float, str]], begin: float, end: float) -> list[str]:
    shown = sorted(line for line in lines if begin <= line[0] <= end)
    return [f"{at - history.begun:8.3f} s  {text}" for at, text in shown]


def _pose(history: History, side: str, at: float) -> str:
    """Return where a side was [deg or mm]."""
    rows = [row for row in history.truth[side] if row[0] <= at]
    if not rows:
        return f"{side} unknown"
    values = (q / joint.scale for q, joint in zip(rows[-1][1], history.joints))
    return f"{side} " + " ".join(f"{value:.2f}" for value in values)
