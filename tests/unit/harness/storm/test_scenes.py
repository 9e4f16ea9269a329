"""What is done in a scene comes from its seed alone."""

from __future__ import annotations

from harness.starter import WAYS_OUT
from harness.storm.deeds import DEEDS
from harness.storm.names import EVERY, STRIKES, THROUGH, WAY_BACK
from harness.storm.scenes import DAY, draw


def test_same_seed_gives_the_same_deeds() -> None:
    """And another seed or scene gives others."""
    assert draw(3, 1) == draw(3, 1)
    assert draw(3, 1) != draw(4, 1) and draw(3, 1) != draw(3, 2)


def test_the_way_back_leads_out_of_every_mode() -> None:
    """Also out of a pause, which refuses RESET and ALIGN."""
    names = [name.text for name in WAY_BACK]
    assert set(WAYS_OUT.values()) <= set(names)
    assert names.index("RESET") < names.index("STOP") < names.index("ALIGN")


def test_the_scene_of_each_run_has_a_standstill_a_bad_line_and_a_clock_that_jumps() -> None:
    """A request waits in the node that stands still."""
    steps = draw(DAY, 0)
    assert {"halt", "line", "clock"} <= {step.name for step in steps}
    halt, request, _ = steps[:3]
    assert halt.name == "halt" and request.name in THROUGH[str(halt.arguments[0])]


def test_every_deed_can_be_done_and_every_one_is_drawn() -> None:
    """Names, functions and scenes fit together."""
    assert {name.text for name in EVERY} == set(DEEDS)
    drawn = {step.name for seed in range(60) for step in draw(seed, 0)}
    assert drawn == set(DEEDS) | {name.text for name in STRIKES}
