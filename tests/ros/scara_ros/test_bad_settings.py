"""A node with a broken configuration ends at once, with one sentence."""

from __future__ import annotations

from pathlib import Path

import pytest
from contract.settings.test_bad_files import TABLE
from harness.ros import Ros
from harness.running.thorough import thorough
from harness.yaml_files import copy_configuration

KINDS = (
    *("half a character", "a number of 5000 digits", "an unknown key"),
    *thorough("empty", "Latin-1", "a tab", "many lists", "a program"),
)
"""One of each room of the table; all kinds, on all files, each time: tests/contract/settings."""


@pytest.mark.parametrize("kind", KINDS)
def test_a_bad_file_ends_a_node_with_code_2_and_one_sentence(
    kind: str, ros: Ros, tmp_path: Path
) -> None:
    """File, line and key; no traceback."""
    folder = tmp_path / "config"
    folder.mkdir()
    file = copy_configuration(folder) / "robot.yaml"
    bad = TABLE[kind](file.read_text(encoding="utf-8"))
    file.write_bytes(bad.content)
    node = ros.run("scara_control", "kinematics_server", f"_config_dir:={folder}")
    assert node.wait(20.0) == 2
    said = [line for line in node.output.splitlines() if line.strip()]
    assert len(said) == 1 and str(file) in said[0] and bad.key in said[0], node.output
    assert f"line {bad.line}" in said[0], node.output
