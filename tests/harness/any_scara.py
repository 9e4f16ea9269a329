"""SCARAs of random sizes, as somebody may ask the doctor for."""

from __future__ import annotations

import random
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from unittest.mock import patch

from robot_doctor.new_profile_io import make_scara
from robot_doctor.new_scara import ScaraSize

from harness.workspace import ROOT

MADE = "made"
"""What such a robot is called."""


def any_size(seed: int) -> ScaraSize:
    """Return a SCARA of random lengths, 280 to 1,000 mm of reach, in each way to build it."""
    chance = random.Random(seed)
    l1 = round(chance.uniform(140.0, 500.0))
    l2 = round(l1 * chance.uniform(0.6, 1.4))
    stroke = round(chance.uniform(80.0, 400.0))
    ways = [(axes, table, down) for axes in (3, 4) for table in (False, True) for down in (0, 1)]
    axes, table, down = ways[seed % len(ways)]
    return ScaraSize(l1, min(l2, 500), stroke, 4 if axes == 4 else 3, table, bool(down))


@contextmanager
def made_scara(seed: int) -> Iterator[Path]:
    """Give the folder of all YAML files with a robot ``MADE``, as ``doctor new`` makes it."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        shutil.copytree(ROOT / "config", folder / "config")
        with patch("scara_config.robot.description_path", folder.joinpath):
            make_scara(folder / "config", MADE, any_size(seed), folder)
            yield folder / "config"
