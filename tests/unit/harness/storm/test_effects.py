"""A storm whose own acts had no effect fails."""

from __future__ import annotations

import dataclasses
from typing import Any

import pytest
from harness.storm.rules.effects import EFFECTS, Effect
from harness.storm.rules.history import Decided, Deed, History, Strike, Told
from harness.storm.rules.literal import STANDS, history, motion, moving, stop
from harness.storm.rules.monitor import judge
from harness.storm.scenes import OPENINGS, Step
from harness.storm.storm import Scene

HEARD = [effect for effect in EFFECTS if effect.name.endswith("is heard")]
HELD = [Told(0.05 * k, "IDLE", holder="operator 1") for k in range(200)]


def named(name: str, deed: Deed, **fields: Any) -> Deed:
    """Return a deed under another name."""
    return dataclasses.replace(deed, name=name, **fields)


STOPPED = Decided(4.0, "TWIN_LEADS", "STOP", "STOPPED", "")
REFUSED = {"success": False, "said": "operator 1 holds control, for 1 s now: ask for it"}
PLAYED: dict[str, tuple[list[Step], dict[str, Any]]] = {
    "stalled": (
        [Step(1.9, "halt", ("gateway", 0.5))],
        {
            "deeds": [motion(1.0), motion(2.1), stop(2.2), motion(3.0), stop(4.0)],
            "strikes": [Strike("halt gateway 0.5", 2.0, 2.5)],
        },
    ),
    "page": (
        [],
        {
            "deeds": [
                named("page jog", motion(1.0, until=1.5)),
                named("gateway MOVE", motion(1.2, answered=1.3), **REFUSED),
                stop(4.0),
            ],
            "states": HELD,
        },
    ),
    "deaf": ([], {"deeds": [motion(1.0), stop(4.0), named("jog", motion(5.0))]}),
}


def scene(name: str, **changed: Any) -> Scene:
    """Return a scene that opens so, in which all went as it should; or changed."""
    steps, known = PLAYED[name]
    moves = changed.pop("moves", moving((1.1, 4.1, 30.0)))
    known = {"decisions": [STOPPED], **known, **changed}
    made: History = history(moves, moves, **known)
    return Scene(0, OPENINGS.index(name), steps, made, judge(made))


def missing(played: Scene) -> list[str]:
    """Return what has not happened in a scene that was played for it."""
    names = {f"{effect.name} [times]": effect.name for effect in EFFECTS}
    return [names[row.metric] for row in played.rows() if row.metric in names and not row.holds]


@pytest.mark.parametrize("name", sorted(PLAYED))
def test_scene_with_its_effects_keeps_the_rule(name: str) -> None:
    """Whatever it opens with."""
    assert missing(scene(name)) == []


@pytest.mark.parametrize(
    ("name", "changed", "missed"),
    [
        ("deaf", {"moves": STANDS}, ["a command moves a side"]),
        ("deaf", {"decisions": []}, ["a stop of the pair is obeyed"]),
        ("deaf", {"deeds": [motion(1.0), stop(4.0)]}, ["a program goes on behind a stop"]),
        (
            "stalled",
            {"strikes": [Strike("halt gateway 0.5", 2.0, 2.5, seen=False)]},
            ["a fault breaks what it shall", "a request and a stop in one stall"],
        ),
        (
            "stalled",
            {"deeds": [motion(1.0), stop(2.2), stop(4.0)]},
            ["a request and a stop in one stall"],
        ),
        (
            "page",
            {"states": []},
            ["the page jogs and holds control", "a stranger is refused beside the holder"],
        ),
        (
            "page",
            {"deeds": [*PLAYED["page"][1]["deeds"][::2]]},
            ["a stranger is refused beside the holder"],
        ),
    ],
)
def test_scene_whose_own_acts_had_no_effect_is_found(
    name: str, changed: dict[str, Any], missed: list[str]
) -> None:
    """Each effect is missed by its name."""
    assert missing(scene(name, **changed)) == missed


def test_storm_that_does_nothing_at_all_misses_everything_it_was_played_for() -> None:
    """It breaks no rule of the pair, and fails."""
    idle = Scene(0, 0, [Step(0.3, "halt", ("gateway", 0.5))], history(), [])
    played = ("any", "struck", "stalled")
    assert missing(idle) == [e.name for e in EFFECTS if e.played in played and e not in HEARD]


@pytest.mark.parametrize("effect", HEARD)
def test_storm_that_does_not_see_a_side_fails(effect: Effect) -> None:
    """Not at all, or no longer once it was started again: its rules cannot break."""
    side = "real" if "robot" in effect.name else "twin"
    moves = moving((1.1, 4.1, 30.0))
    anew = {side: [5.0]}
    for rows, births, missed in (
        ([], {}, [effect.name]),
        (moves, anew, []),
        (moving((1.1, 4.1, 30.0), ends=4.9), anew, [effect.name]),
    ):
        made = history(**{"real": moves, "twin": moves, side: rows}, births=births)
        assert [name for name in missing(Scene(0, 3, [], made, [])) if "heard" in name] == missed
