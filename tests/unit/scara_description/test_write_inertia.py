"""The command that keeps a URDF's inertia up to date."""

from __future__ import annotations

import pytest
from scara_description.write_inertia_node import main

TEXT = """<robot name="r"><link name="part">
  <collision><geometry><box size="1 2 3"/></geometry></collision>
  <inertial><mass value="12"/></inertial>
</link></robot>
"""


def test_writes_once_and_then_finds_the_file_up_to_date(tmp_path, monkeypatch, capsys):
    """The second run leaves the file alone."""
    path = tmp_path / "a.urdf"
    path.write_text(TEXT)
    monkeypatch.setattr("sys.argv", ["write_inertia", str(path)])
    for _ in range(2):
        with pytest.raises(SystemExit, match="0"):
            main()
    assert capsys.readouterr().out == f"{path}: inertia written\n{path}: up to date\n"
    assert 'ixx="13"' in path.read_text()


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (None, "No such file"),
        ("<robot>", "no element found"),
        (
            TEXT.replace("box size", "mesh scale"),
            "link part has a collision shape that is neither box nor cylinder",
        ),
        (
            TEXT.replace('size="1 2 3"', ""),
            "link part: <box> has size = '': expected 3 finite numbers",
        ),
    ],
)
def test_file_that_cannot_be_done_stays_as_it_is(tmp_path, monkeypatch, text, reason):
    """The reason and the file are named, the exit code is not zero."""
    path = tmp_path / "a.urdf"
    if text is not None:
        path.write_text(text)
    monkeypatch.setattr("sys.argv", ["write_inertia", str(path)])
    with pytest.raises(SystemExit, match=f"a.urdf: .*{reason}"):
        main()
    assert text is None or path.read_text() == text
