"""Memory that a process gives back goes, and what it was goes on working."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest

GIVEN_BACK = """
import json, re
from pathlib import Path
import numpy
from scara_ros.process.memory_io import give_back_code

def resident() -> int:
    text = Path("/proc/self/smaps").read_text()
    piece = re.compile(r"r-xp .*openblas.*\\n(?:[A-Z].*\\n)*?Rss: +([0-9]+) kB")
    return sum(map(int, piece.findall(text)))

numbers = numpy.random.default_rng(1).normal(size=(60, 60))
first = numpy.linalg.inv(numbers)
before = resident()
give_back_code()
after = resident()
again = numpy.linalg.inv(numbers)
print(json.dumps([before, after, bool((first == again).all())]))
"""

PAGES = """
import sys
from scara_ros.page.page_library_io import CLIENTS, ui
loaded = [name for name in CLIENTS if name in sys.modules]
import requests
print(loaded, bool(ui.label), requests.__name__)
"""


def _said(program: str) -> str:
    return subprocess.run(
        [sys.executable, "-c", program], check=True, capture_output=True, text=True
    ).stdout


def test_code_of_a_library_goes_and_is_read_again_when_it_is_called() -> None:
    """The same numbers come, to the last bit."""
    before, after, same = json.loads(_said(GIVEN_BACK))
    assert before > 200  # kB of the library that were read
    assert after < before / 2
    assert same


@pytest.mark.filterwarnings("ignore")
def test_a_page_loads_no_http_client_and_others_may() -> None:
    """What its web-socket library would load to be a client itself."""
    assert _said(PAGES) == "[] True requests\n"
