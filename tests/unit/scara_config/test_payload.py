"""The table of payloads: each robot's files, and what is refused with file, key and value."""

from __future__ import annotations

from pathlib import Path

import pytest
from ruamel.yaml import YAML
from scara_config import ConfigError
from scara_config.payload import Payload, PayloadError, load_payloads
from scara_config.profile import CHOICE

ROOT = Path(__file__).parents[3]
CONFIG = ROOT / "config"
RATED = {"fanuc_sr6ia": 6.0, "fanuc_sr3ia": 3.0, "scara_4axis": 3.0, "articulated_six": 3.0}


@pytest.mark.parametrize(("robot", "rated"), RATED.items())
def test_each_robot_has_an_empty_tool_a_part_and_what_it_is_rated_for(
    robot: str, rated: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """At the start nothing hangs at the tool, and the controller is told so."""
    monkeypatch.setenv(CHOICE, robot)
    table = load_payloads(CONFIG)
    masses = {payload.name: payload.mass_kg for payload in table.payloads}
    assert table.rated_kg == rated
    assert (masses["empty"], masses["part"], masses["rated"]) == (0.0, 0.05, rated)
    assert table.find(table.set_number).name == table.find(table.mounted_number).name == "empty"


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"set_number": 9}, r"payloads\.yaml: set_number = 9: Expected one of 1, 2, 3, 4"),
        ({"mounted_number": 5}, r"mounted_number = 5: Expected one of 1, 2"),
        ({"rated_kg": 5.9}, r"payloads: rated\.mass_kg = 6: is outside \[0, 5\.9\] kg"),
        ({"rated_kg": -1.0}, r"rated_kg = -1\.0: Expected"),
        ({"payloads": [{"number": 11, "name": "x", "mass_kg": 1.0}]}, r"number = 11: Expected"),
        (
            {"payloads": [{"number": 1, "name": name, "mass_kg": 0.0} for name in "ab"]},
            r"payloads: number = 1: occurs more than once",
        ),
        (
            {"payloads": [{"number": 1, "name": "x", "mass_kg": 1.0, "inertia_kg_m2": [1, 1, 3]}]},
            r"x\.inertia_kg_m2 = \[1\.0, 1\.0, 3\.0\]: no body has",
        ),
        (
            {"payloads": [{"number": 1, "name": "x", "mass_kg": 0.0, "inertia_kg_m2": [1, 1, 1]}]},
            r"inertia_kg_m2 = .*: must be 0 without a mass",
        ),
        (
            {"payloads": [{"number": 1, "name": "x", "mass_kg": 1.0, "centre_m": [0, 0, 2]}]},
            r"centre_m.* = 2.*: Expected",
        ),
    ],
)
def test_a_wrong_table_is_refused(change: dict[str, object], text: str, tmp_path: Path) -> None:
    """The text names file, key, value and what is allowed."""
    source = CONFIG / "robots" / "fanuc_sr6ia" / "payloads.yaml"
    tree = YAML(typ="safe").load(source) | change
    with (tmp_path / "payloads.yaml").open("w") as file:
        YAML(typ="safe").dump(tree, file)
    with pytest.raises(ConfigError, match=text):
        load_payloads(tmp_path)


def test_an_entry_is_replaced_and_the_others_stay() -> None:
    """What the robot cannot carry replaces nothing."""
    table = load_payloads(CONFIG / "robots" / "fanuc_sr6ia")
    changed = table.replaced(Payload(2, "tool", 1.5, (0.0, 0.0, 0.1)))
    assert [p.mass_kg for p in changed.payloads] == [0.0, 1.5, 3.0, 6.0]
    with pytest.raises(PayloadError, match=r"mass_kg = 6\.5: is outside \[0, 6\] kg"):
        table.replaced(Payload(2, "tool", 6.5))
    with pytest.raises(PayloadError, match=r"mass_kg = nan: is outside"):
        table.replaced(Payload(2, "tool", float("nan")))
    with pytest.raises(PayloadError, match=r"centre_m = \[0\.0, 0\.0, 1\.5\]: each must be in"):
        table.replaced(Payload(2, "tool", 1.0, (0.0, 0.0, 1.5)))
    with pytest.raises(PayloadError, match=r"number = 7: is no payload .* has 1 \(empty\), 2"):
        table.find(7)
