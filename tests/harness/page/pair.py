"""What the twin controller tells of the pair, as ``twin_controller/shadow`` answers it."""

from __future__ import annotations

import json

SIDE = {"position": [1.0, 2.0], "velocity": [0.0, None], "stamp": 99.9, "standing_still": True}


def shadow_document(stamp: float) -> str:
    """Return what the twin controller answers."""
    tree = {
        "stamp": stamp,
        "revision": 7,
        "decision": 3,
        "configuration": "abc",
        "names": ["joint_1", "joint_3"],
        "units": ["deg", "mm"],
        "authority": {"mode": "IDLE", "leader": "", "why": "at rest", "alarm": ""},
        "desired": {"of": "both", "source": "agreed", "position": [1.0, 2.0], "target": []},
        "real": SIDE,
        "twin": {"position": [], "velocity": [], "stamp": None, "standing_still": False},
        "deviation": {
            "position": [0.0, 0.1],
            "tool_mm": None,
            "path_mm": 0.0,
            "lag": None,
            "follower_lag": 0.0,
            "diverged": False,
        },
        "speed": {"requested": 50.0, "applied": 50.0, "limited": False, "reason": ""},
        "links": [{"name": "real", "connected": True}, {"name": "twin", "connected": False}],
    }
    return json.dumps(tree)
