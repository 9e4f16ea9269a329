"""farm.yaml: what is no key of its place is refused there."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from farm.config import load_farm
from harness.yaml_files import CONFIG
from scara_config import ConfigError


@pytest.mark.parametrize(
    ("before", "place"),
    [
        ("site: site", "farm.yaml"),
        ("  port: 7447", "router"),
        ("  state_rate_hz: 5", "link"),
        ("    default_role: watcher", "link.rights"),
        ("  port: 8070", "desk"),
    ],
)
def test_a_key_that_nobody_knows_is_refused_wherever_it_stands(
    tmp_path: Path, before: str, place: str
) -> None:
    """A typing error would leave what was meant as it is, unseen."""
    file = tmp_path / "farm" / "farm.yaml"
    file.parent.mkdir()
    shutil.copy(CONFIG / "farm" / "farm.yaml", file)
    assert load_farm(tmp_path)
    text = file.read_text(encoding="utf-8")
    assert before in text
    indent = " " * (len(before) - len(before.lstrip()))
    file.write_text(text.replace(before, f"{indent}nonsense: 1\n{before}"), encoding="utf-8")
    with pytest.raises(ConfigError, match=rf"{place}.*nonsense"):
        load_farm(tmp_path)
