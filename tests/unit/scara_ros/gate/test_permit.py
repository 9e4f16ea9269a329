"""What follows from a judgement, and from none."""

from __future__ import annotations

from pathlib import Path

import pytest
from harness.yaml_files import CONFIG, changed_yaml, shipped
from scara_config import ConfigError
from scara_ros.gate.permit import Judgement, permit, unjudged
from scara_ros.gate.settings import Act, GateSettings, Unjudged, load_gate

REFUSED = Judgement(
    True,
    "REFUSED at 0.31 s: joint_3 = -0.3 m is outside [-0.21, 0]",
    "limit",
    (450.4, -300.0, 12.0),
)
FREE = Judgement(False, "OK: takes 0.43 s")


def settings(act: Act, without: Unjudged = Unjudged.MOVE) -> GateSettings:
    """Return settings with this action."""
    return GateSettings(act, 400.0, 5000.0, without, False)


@pytest.mark.parametrize("act", [Act.REFUSE, Act.WARN])
def test_what_is_free_passes_without_a_word(act: Act) -> None:
    """Whoever asked for it hears nothing of the gate."""
    found = permit(settings(act), FREE)
    assert (found.allowed, found.text, found.note) == (True, FREE.sentence, "")


def test_what_is_refused_does_not_begin_and_says_why() -> None:
    """Joint, value, range, time, place and the file to look into."""
    found = permit(settings(Act.REFUSE), REFUSED)
    assert not found.allowed
    assert found.text == (
        "REFUSED at 0.31 s: joint_3 = -0.3 m is outside [-0.21, 0] near (450, -300, 12) mm "
        "(range of the joint: robot.yaml)"
    )


def test_a_warning_moves_and_is_told() -> None:
    """The same words beside the answer."""
    found = permit(settings(Act.WARN), REFUSED)
    assert found.allowed
    assert found.note.startswith("moved all the same (gate: warn): REFUSED at 0.31 s")


@pytest.mark.parametrize(
    ("act", "without", "moves"),
    [
        (Act.REFUSE, Unjudged.MOVE, True),
        (Act.REFUSE, Unjudged.REFUSE, False),
        (Act.WARN, Unjudged.REFUSE, True),
    ],
)
def test_without_a_judge_the_file_decides(act: Act, without: Unjudged, moves: bool) -> None:
    """And the reason is told either way; a gate that only warns refuses nothing."""
    found = unjudged(settings(act, without), "no judge runs")
    assert found.allowed is moves
    assert "no judge runs" in found.text


def test_the_shipped_gate_refuses_and_waits_for_less_than_a_second() -> None:
    """Each motion waits for it."""
    found = load_gate(CONFIG)
    assert (found.gate, found.gate_without_judge) == (Act.REFUSE, Unjudged.MOVE)
    assert found.patience < 1.0 < found.program_patience


def test_another_word_is_refused(tmp_path: Path) -> None:
    """With file, key and what is allowed."""
    folder = changed_yaml(shipped("what_if.yaml"), tmp_path, ["gate"], "perhaps")
    with pytest.raises(ConfigError, match=r"what_if.yaml.*gate.*perhaps"):
        load_gate(folder)
