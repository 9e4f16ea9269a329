"""A wrong configuration is refused with file, key, value and what is allowed."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import msgspec
import pytest
from msgspec import Meta
from scara_config import ConfigError, config_directory, convert, load, package_folder
from scara_config.loader import load_keys


class Axis(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A part of the example."""

    name: str
    speed_percent: Annotated[float, Meta(ge=1.0, le=100.0)]


class Example(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """An example of a configuration."""

    rate_hz: Annotated[int, Meta(gt=0)]
    axes: list[Axis]
    gains: dict[str, float] = {}
    rows: dict[str, dict[str, int]] = {}


GOOD = "rate_hz: 100\naxes:\n  - {name: a, speed_percent: 50}\n"


def test_good_file_becomes_the_structure(tmp_path: Path) -> None:
    """Numbers stay numbers, an int is a float where a float is wanted."""
    file = tmp_path / "example.yaml"
    file.write_text(GOOD)
    assert load(file, Example) == Example(rate_hz=100, axes=[Axis("a", 50.0)])


@pytest.mark.parametrize(
    ("text", "key", "value", "allowed"),
    [
        ("rate_hz: 0\naxes: []\n", "rate_hz", "0", ">= 1"),
        ("rate_hz: fast\naxes: []\n", "rate_hz", "'fast'", "Expected `int`"),
        ("rate_hz: 1.5\naxes: []\n", "rate_hz", "1.5", "Expected `int`"),
        ("rate_hz: null\naxes: []\n", "rate_hz", "None", "Expected `int`"),
        (
            "rate_hz: 1\naxes:\n  - {name: a, speed_percent: 101}\n",
            r"axes\[0\]\.speed_percent",
            "101",
            "<= 100",
        ),
        (
            "rate_hz: 1\naxes:\n  - {name: a, speed_percent: .nan}\n",
            r"axes\[0\]\.speed_percent",
            "nan",
            "",
        ),
        (
            "rate_hz: 1\naxes:\n  - {name: 7, speed_percent: 10}\n",
            r"axes\[0\]\.name",
            "7",
            "Expected `str`",
        ),
        (
            "rate_hz: 1\naxes:\n  - {name: a}\n",
            r"axes\[0\]",
            r"\{name\}",
            "missing required field `speed_percent`",
        ),
        ("axes: []\n", r"\(top level\)", r"\{axes\}", "missing required field `rate_hz`"),
        (
            "rate_hz: 1\naxes: []\nrate: 2\n",
            r"\(top level\)",
            r"\{rate_hz, axes, rate\}",
            "unknown field `rate`",
        ),
        (
            "rate_hz: 1\naxes: []\ngains: {p: 1, i: high}\n",
            r"gains\.i",
            "'high'",
            "Expected `float`",
        ),
        (
            "rate_hz: 1\naxes: []\nrows: {a: {b: 1, c: x}, d: {e: 1}}\n",
            r"rows\.a\.c",
            "'x'",
            "Expected `int`",
        ),
        ("- 1\n", r"\(top level\)", r"\[1\]", "Expected `object`"),
        ("", r"\(top level\)", "None", "Expected `object`"),
    ],
)
def test_wrong_value_is_refused_with_key_value_and_allowed(
    tmp_path: Path, text: str, key: str, value: str, allowed: str
) -> None:
    """One line holds all a person needs to mend the file."""
    file = tmp_path / "example.yaml"
    file.write_text(text)
    with pytest.raises(
        ConfigError, match=rf"example\.yaml: {key}.* = .*{value}.*: .*{allowed}"
    ) as caught:
        load(file, Example)
    assert "\n" not in str(caught.value)


def test_some_values_of_a_file_are_read_by_their_keys(tmp_path: Path) -> None:
    """Whatever else is in it; one that does not fit is named as if all were read."""
    file = tmp_path / "other.yaml"
    file.write_text("part:\n  speed: 30.0\n  name: x\nport: 99999\nmore: [1]\n")
    kinds = {"port": int, "part.speed": float}
    assert load_keys(file, kinds) == [99999, 30.0]
    with pytest.raises(ConfigError, match=r"other.yaml: port = 99999.*65535.*line 4"):
        load_keys(file, {**kinds, "port": Annotated[int, Meta(le=65535)]})
    with pytest.raises(ConfigError, match=r"part.*speeed"):
        load_keys(file, {"part.speeed": float})


def test_missing_file_is_named(tmp_path: Path) -> None:
    """The reason is the system's."""
    with pytest.raises(ConfigError, match=r"nowhere\.yaml: cannot be read: No such file"):
        load(tmp_path / "nowhere.yaml", Example)


@pytest.mark.parametrize("text", ["a: [1, 2\n", "a: 1\na: 2\n", "a: b: c\n", "\tx: 1\n"])
def test_broken_yaml_is_named(tmp_path: Path, text: str) -> None:
    """A key given twice is an error as well: which one would hold?"""
    file = tmp_path / "broken.yaml"
    file.write_text(text)
    with pytest.raises(ConfigError, match=r"broken\.yaml: is no valid YAML"):
        load(file, Example)


def test_long_value_is_shortened_in_the_error() -> None:
    """The line stays readable."""
    with pytest.raises(ConfigError, match=r"rate_hz = 'x{20,}.*\.\.\.: Expected") as caught:
        convert({"rate_hz": "x" * 5000, "axes": []}, Example, "here")
    assert len(str(caught.value)) < 200


def test_tree_of_the_caller_is_not_touched_by_an_error() -> None:
    """The search for the wrong key works on a copy."""
    tree = {"rate_hz": 1, "axes": [], "rows": {"a": {"b": 1, "c": "x"}, "d": {}}}
    with pytest.raises(ConfigError, match=r"rows\.a\.c = 'x'"):
        convert(tree, Example, "here")
    assert tree == {"rate_hz": 1, "axes": [], "rows": {"a": {"b": 1, "c": "x"}, "d": {}}}


def test_override_is_the_configuration_directory(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """A second cell reads its own folder; every program of it inherits the variable."""
    monkeypatch.setenv("SCARA_CONFIG_DIR", str(tmp_path))
    assert config_directory() == tmp_path


def test_configuration_directory_is_the_package_without_override(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """ROS finds the package in the source space."""
    monkeypatch.delenv("SCARA_CONFIG_DIR", raising=False)
    assert (config_directory() / "bringup.yaml").is_file()


def test_unknown_package_says_what_to_do(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Forgetting env.sh is the usual cause."""
    monkeypatch.delenv("SCARA_CONFIG_DIR", raising=False)
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path))
    with pytest.raises(ConfigError, match=r"source env\.sh"):
        config_directory()


def test_folders_are_searched_for_packages_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """A node asks a dozen times; the search takes longer than all else that it reads."""
    import rospkg.rospack

    package_folder("scara_config")
    monkeypatch.setattr(rospkg.rospack, "list_by_path", lambda *_: pytest.fail("searched again"))
    assert (package_folder("scara_description") / "urdf").is_dir()
