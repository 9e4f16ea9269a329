"""A quick loader for rules over all numbers of all files."""

from __future__ import annotations

import json

import pytest
from scara_config import loader


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the loader read JSON, which is YAML, and name no lines: both take most of its time.

    What YAML can hold, and lines: settings/test_bad_files.py.
    """
    monkeypatch.setattr(loader, "_parsed", json.loads)
    monkeypatch.setattr(loader, "line_of", lambda text, keys: None)
