"""Engines that a process has from its parent do what its own would do."""

from __future__ import annotations

import subprocess
import sys

from harness.yaml_files import CONFIG

PROGRAM = """
import json, os, sys
from scara_config import load_robot
from scara_control.dynamics.arm_model_io import ArmModel
from scara_control.dynamics.engine_io import prepare_engines

def reckon():
    robot = load_robot(sys.argv[1])
    names = [joint.name for joint in robot.twin_joints]
    found = []
    models = [ArmModel(robot.description, names, robot.tool_frame, gravity=9.81) for _ in range(3)]
    for k in range(50):
        q, v = [0.01 * k] * len(names), [0.1 * k] * len(names)
        found += [value.hex() for model in models for value in model.inverse_dynamics(q, v, q)]
    return json.dumps(found)

print(reckon(), flush=True)
if sys.argv[2] == "prepared":
    prepare_engines()
for _ in range(2):
    child = os.fork()
    if not child:
        print(reckon(), flush=True)
        os._exit(0)
    assert os.waitpid(child, 0)[1] == 0
"""


def test_inherited_engines_reckon_as_new_ones() -> None:
    """Bit by bit, in both children, with more engines than there are."""
    said = [
        [line for line in _said(how).splitlines() if line.startswith("[")]
        for how in ("prepared", "new")
    ]
    assert len(said[0]) == 3
    assert len({*said[0], *said[1]}) == 1


def test_preparing_prints_nothing() -> None:
    """The library says when it was built, in the terminal of whoever starts a cell."""
    words = "from scara_control.dynamics.engine_io import prepare_engines; prepare_engines()"
    done = subprocess.run([sys.executable, "-c", words], capture_output=True, text=True, check=True)
    assert (done.stdout, done.stderr) == ("", "")


def _said(how: str) -> str:
    words = [sys.executable, "-c", PROGRAM, str(CONFIG), how]
    return subprocess.run(words, capture_output=True, text=True, check=True).stdout
