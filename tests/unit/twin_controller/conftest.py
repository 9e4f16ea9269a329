"""What many tests of the core begin with."""

from __future__ import annotations

import pytest
from harness.pair import Pair, idle_pair


@pytest.fixture
def pair() -> Pair:
    """Return a connected pair, IDLE at home; a module with other wishes has its own."""
    return idle_pair()
