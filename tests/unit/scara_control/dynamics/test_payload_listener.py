"""What the motion nodes make of twin/payload."""

from __future__ import annotations

from pathlib import Path
from unittest.mock import Mock

import pytest
from scara_config import load_robot
from scara_control.config import load_motion
from scara_control.dynamics.effort import Load
from scara_control.dynamics.payload_listener_node import PayloadListener

from scara_msgs.msg import Payload, PayloadState

CONFIG = Path(__file__).parents[4] / "config"
PART = Payload(number=1, name="part", mass=0.05)


def test_load_follows_what_was_told_and_a_part_that_is_held() -> None:
    """Delivered on change only; without any mass there is no load, and no engine."""
    heard: list[Load | None] = []
    listener = PayloadListener(load_robot(CONFIG), load_motion(CONFIG), heard.append)
    empty, rated = Payload(number=1, name="empty"), Payload(number=4, name="rated", mass=6.0)
    for told, holding in (
        (empty, False),
        (rated, False),
        (rated, False),
        (rated, True),
        (rated, False),
        (empty, False),
    ):
        listener(PayloadState(told=told, mounted=empty, holding=holding, part=PART))
    assert [load is None for load in heard] == [False, False, False, True]
    assert heard[0] is heard[2]
    first, held = heard[0], heard[1]
    assert first is not None and held is not None
    assert first.permitted[0] == pytest.approx(285.0)
    q = [0.0] * 4
    more = held.model.mass_matrix(q)[2][2] - first.model.mass_matrix(q)[2][2]
    assert more == pytest.approx(0.05)


def test_a_payload_whose_model_has_failed_is_tried_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """Else motion would go on being planned for what hung there before, until the next change."""
    heard: list[Load | None] = []
    listener = PayloadListener(load_robot(CONFIG), load_motion(CONFIG), heard.append)
    rated = PayloadState(told=Payload(number=4, name="rated", mass=6.0))
    with monkeypatch.context() as broken:
        broken.setattr(listener, "_load", Mock(side_effect=OSError("no space left")))
        with pytest.raises(OSError, match="no space left"):
            listener(rated)
    listener(rated)
    assert [load is not None for load in heard] == [True]
