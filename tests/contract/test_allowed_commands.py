"""What the twin controller says of its commands is what it then answers."""

from __future__ import annotations

import msgspec
import pytest
from harness.pair import HOME, SETUP, Pair
from twin_controller.core.lead.commands.allowed import refusals
from twin_controller.core.lead.modes import EVERY_COMMAND, Mode, Trigger
from twin_controller.core.lead.table import LEADING, look_up

TARGETS = {"MOVE": {"target": (0.4, 0.1, 0.1)}, "MOVE_JOINTS": {"target": HOME}}
SPEED = {"SPEED": {"speed_percent": 50.0}}
MODES = [(mode, None) for mode in Mode if mode is not Mode.PAUSED]
MODES += [(Mode.PAUSED, led) for led in LEADING]


def pair_in(mode: Mode, paused: Mode | None) -> Pair:
    """Return a ready pair that is put into a mode."""
    pair = Pair()
    pair.connect()
    pair.run_until(lambda: pair.state.lead.mode is Mode.IDLE, 10.0)
    if mode is Mode.OFFLINE:  # with usable links the next step would leave it
        pair.link("twin", False)
    change(pair, mode=mode, paused=paused)
    return pair


def change(pair: Pair, **fields: object) -> None:
    """Change fields of who leads."""
    replace = msgspec.structs.replace
    pair.state = replace(pair.state, lead=replace(pair.state.lead, **fields))


@pytest.mark.parametrize("aligned", [True, False], ids=["aligned", "unaligned"])
@pytest.mark.parametrize(("mode", "paused"), MODES)
def test_answer_is_the_one_announced(mode: Mode, paused: Mode | None, aligned: bool) -> None:
    """Every command in every mode; the words are the same too."""
    wrong = []
    pair = pair_in(mode, paused)
    change(pair, must_align=not aligned)
    before, said = pair.state, refusals(SETUP, pair.state, pair.now)
    for command in EVERY_COMMAND:
        pair.state = before
        reply = pair.operate(command, **TARGETS.get(command, {}), **SPEED.get(command, {}))
        answer = "" if reply.success else reply.message
        if answer != said[command]:
            wrong.append(f"{command}: said {said[command]!r}, answered {answer!r}")
    assert not wrong


@pytest.mark.parametrize(("mode", "paused"), MODES)
def test_jog_and_program_are_allowed_where_that_side_would_lead(
    mode: Mode, paused: Mode | None
) -> None:
    """They are no commands: the side that moves first leads; a jog goes on while the twin leads."""
    state = pair_in(mode, paused).state
    said = refusals(SETUP, state, 0.0)
    assert (said["RUN"] == "") == (look_up(mode, Trigger.REAL_MOVED).to is Mode.REAL_LEADS)
    leads = look_up(mode, Trigger.TWIN_MOVED).to is Mode.TWIN_LEADS
    assert (said["JOG"] == "") == (leads or mode is Mode.TWIN_LEADS)
