"""A recording becomes an MCAP file by the line that docs/evidence.md gives."""

from __future__ import annotations

import subprocess
from collections import Counter
from collections.abc import Callable
from pathlib import Path

from cell_recorder.reading.bag_reader_io import open_bag
from harness.workspace import ROOT
from rosbags.highlevel import AnyReader


def test_the_documents_line_converts_every_message(
    make_bag: Callable[..., Path], tmp_path: Path
) -> None:
    """One MCAP file holds them all, and each can be decoded."""
    bag, out = make_bag(experiments=("real_leads",)), tmp_path / "out"
    lines = (ROOT / "docs" / "evidence.md").read_text().splitlines()
    (line,) = (line for line in lines if "bin/rosbags-convert" in line)
    words = [{"BAG": str(bag), "OUT": str(out)}.get(word, word) for word in line.split()]
    subprocess.run(words, cwd=ROOT, check=True, timeout=30.0)
    assert len(list(out.glob("*.mcap"))) == 1
    with open_bag(bag) as opened, AnyReader([out]) as reader:
        assert Counter(c.topic for c, _, _ in reader.messages()) == opened.topics
        for connection, _, raw in reader.messages():
            reader.deserialize(raw, connection.msgtype)
