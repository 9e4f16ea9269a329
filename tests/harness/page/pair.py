"""What the twin controller tells of the pair, as ``twin_controller/shadow`` answers it."""

from __future__ import annotations

import json

SIDE = {
    "position": {"joint_1": 1.0, "joint_3": 2.0},
    "velocity": {"joint_1": 0.0, "joint_3": None},
    "stamp": 99.9,
    "standing_still": True,
}


def shadow_document(stamp: float) -> str:
    """Return what the twin controller answers."""
    tree = {
        "stamp": stamp,
        "revision": 7,
        "decision": 3,
        "configuration": "abc",
        "units": {"joint_1": "deg", "joint_3": "mm"},
        "authority": {"mode": "IDLE", "leader": "", "why": "at rest", "alarm": ""},
        "desired": {
            "of": "both",
            "source": "agreed",
            "position": {"joint_1": 1.0, "joint_3": 2.0},
            "target": {},
        },
        "real": SIDE,
        "twin": {"position": {}, "velocity": {}, "stamp": None, "standing_still": False},
        "deviation": {
            "position": {"joint_1": 0.0, "joint_3": 0.1},
            "tool_mm": None,
            "path_mm": 0.0,
            "lag": None,
            "follower_lag": 0.0,
            "diverged": False,
        },
        "speed": {"requested": 50.0, "applied": 50.0, "limited": False, "reason": ""},
        "links": {"real": {"connected": True}, "twin": {"connected": False}},
    }
    return json.dumps(tree)
