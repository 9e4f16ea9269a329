"""Which changes of a configuration may come from elsewhere, and what a cell keeps of them."""

from __future__ import annotations

from pathlib import Path

import pytest
from harness.yaml_files import CONFIG
from scara_config import ConfigError, load_robot
from scara_config.profile import copy_in_force
from scara_config.rollout.change import Change, ChangeError, change_of
from scara_config.rollout.kept import (
    RUNNING,
    Kept,
    apply_change,
    changed_copy,
    faults_of,
    kept_file,
    read_kept,
    running_change,
    write_kept,
)

SLOW = Change("slow", {"motion.yaml": {"move.default_speed_percent": 20.0}})
QUICK = Change("quick", {"motion.yaml": {"move.default_speed_percent": 60.0}})


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"farm/farm.yaml": {"link.remote_at_start": True}}, "farm/farm.yaml: no change from else"),
        ({"persons.yaml": {"persons.ann": "operator"}}, "persons.yaml: no change"),
        ({"gateway.yaml": {"host": "0.0.0.0"}}, "gateway.yaml: no change"),
        ({"../../etc/passwd": {"a": 1}}, "../../etc/passwd: no change"),
        ({"/etc/motion.yaml": {"a": 1}}, "/etc/motion.yaml: no change"),
        ({"twin_controller.yaml": {"real.host": "10.0.0.9"}}, "real.host: is decided at the cell"),
        ({"twin_controller.yaml": {"separation.enabled": False}}, "separation.enabled: is decided"),
        ({"twin_controller.yaml": {"limit.x": 1}}, "limit.x: is decided at the cell"),
        # The twin went 64 degrees past a STOP with it, and nobody decided anything.
        (
            {"twin_controller.yaml": {"change.still_tolerance": 1000}},
            "change.still_tolerance: is decided at the cell",
        ),
        ({"twin_controller.yaml": {"change": [1]}}, "change: is decided at the cell"),
        ({"twin_controller.yaml": {"gripper.attempts": 1}}, "gripper.attempts: is decided"),
        ({"twin_controller.yaml": {"shadows.x": 1}}, "shadows.x: is decided at the cell"),
        ({"motion.yaml": {"jog": 1}}, "jog: is decided at the cell"),
        ({"motion.yaml": {"move.time_scale_ramp": 0.1}}, "move.time_scale_ramp: is decided"),
        ({"motion.yaml": {"follow.timeout": 10.0}}, "follow.timeout: is decided at the cell"),
        ({}, "0 values: allowed are 1 to 200"),
        ({"pid_gains.yaml": {f"k{n}": n for n in range(201)}}, "201 values"),
    ],
)
def test_what_protects_or_decides_is_not_changed_from_elsewhere(values: dict, said: str) -> None:
    """Rights, addresses, people, and places outside of the configuration."""
    with pytest.raises(ChangeError) as error:
        change_of({"name": "x", "values": values})
    assert said in str(error.value)


@pytest.mark.parametrize(
    "tree",
    [
        None,
        {"name": "x"},
        {"name": "a/b", "values": SLOW.values},
        {"name": "x", "values": {"motion.yaml": {"move.a": {"b": 1}}}},
        {"name": "x", "values": SLOW.values, "more": 1},
    ],
)
def test_what_is_no_change_is_refused(tree: object) -> None:
    """Each with a text."""
    with pytest.raises(ChangeError, match=r"."):
        change_of(tree)


def test_same_values_have_the_same_digest_whatever_their_order() -> None:
    """And other values another one."""
    one = Change("a", {"x": {"k": 1, "l": 2}, "y": {"m": 3}})
    other = Change("b", {"y": {"m": 3}, "x": {"l": 2, "k": 1}})
    assert one.digest == other.digest != SLOW.digest


def some_key(folder: Path) -> tuple[str, float]:
    """Return a key of motion.yaml with a number, and the number."""
    from ruamel.yaml import YAML

    tree = YAML(typ="safe").load((folder / "motion.yaml").read_text())
    key = next(k for k, v in tree["trim"].items() if isinstance(v, float))
    return f"trim.{key}", tree["trim"][key]


def test_a_change_is_written_into_a_copy_only(tmp_path: Path) -> None:
    """Comments stay, and the cell's own files are as they were."""
    key, value = some_key(CONFIG)
    before = (CONFIG / "motion.yaml").read_bytes()
    change = Change("x", {"motion.yaml": {key: 0.9 * value}})
    assert faults_of(change, CONFIG) == []
    copy_in_force(CONFIG, tmp_path)
    assert running_change(tmp_path) is None
    apply_change(change, CONFIG, tmp_path)
    assert some_key(tmp_path) == (key, pytest.approx(0.9 * value))
    assert "#" in (tmp_path / "motion.yaml").read_text()
    running = running_change(tmp_path)
    assert running is not None and (running.change, running.base) == (change, str(CONFIG))
    assert (CONFIG / "motion.yaml").read_bytes() == before
    assert load_robot(tmp_path).name == load_robot(CONFIG).name


def test_the_cell_says_what_is_wrong_with_a_change() -> None:
    """File, key, value and what is allowed, without the place of the copy."""
    key, _ = some_key(CONFIG)
    (fault,) = faults_of(Change("x", {"motion.yaml": {key: "fast"}}), CONFIG)
    assert fault.startswith("motion.yaml") and key in fault
    (unknown,) = faults_of(Change("x", {"motion.yaml": {"trim.sped": 1.0}}), CONFIG)
    assert "sped" in unknown
    (missing,) = faults_of(Change("x", {"payloads.yml": {"a": 1}}), CONFIG)
    assert missing.startswith("payloads.yml: no change from elsewhere may touch it")


def test_a_kept_change_is_judged_by_the_rule_of_today() -> None:
    """A cell that took it when it was allowed leaves it at its next start."""
    (fault,) = faults_of(
        Change("old", {"twin_controller.yaml": {"change.still_tolerance": 1000.0}}), CONFIG
    )
    assert "is decided at the cell" in fault


def test_a_copy_for_a_look_is_gone_afterwards() -> None:
    """Nothing is left behind."""
    key, value = some_key(CONFIG)
    with changed_copy(Change("x", {"motion.yaml": {key: value}}), CONFIG) as folder:
        assert (folder / RUNNING).is_file()
    assert not folder.exists()


def test_what_was_proven_is_what_taking_back_leads_to() -> None:
    """A change that was never proven is not gone back to."""
    kept = Kept().offered(SLOW, "ann@d").start().ready()
    assert (kept.wanted, kept.before, kept.number) == (SLOW, None, 1)
    again = kept.offered(QUICK, "ann@d")
    assert (again.wanted, again.before) == (QUICK, SLOW)
    other = again.offered(Change("third", {}), "bob@d")
    assert other.before == SLOW
    back = other.taken_back("ann@d")
    assert (back.wanted, back.before, back.proven, back.number) == (SLOW, None, True, 4)


def test_a_cell_that_did_not_get_ready_leaves_its_change_at_the_next_start() -> None:
    """The first start tries it, the second one goes back and says so."""
    kept = Kept().offered(SLOW, "ann@d").start().ready().offered(QUICK, "ann@d")
    tried = kept.start()
    assert (tried.wanted, tried.begun, tried.proven) == (QUICK, True, False)
    left = tried.start()
    assert left.wanted == SLOW
    assert left.note == f"left {QUICK.text} by itself: the cell did not get ready with it"
    assert left.start() == left


def test_what_is_kept_is_whole_or_as_it_was(tmp_path: Path) -> None:
    """It survives, and a file that is no such thing is said."""
    file = kept_file(tmp_path, "milk_2")
    assert read_kept(file) == Kept()
    kept = Kept().offered(SLOW, "ann@d")
    write_kept(file, kept)
    assert read_kept(file) == kept
    for damaged in (b"{", b'{"by": "\xff"}'):
        file.write_bytes(damaged)
        with pytest.raises(ConfigError, match=f"{file}: cannot be read.*remove it"):
            read_kept(file)
        (tmp_path / RUNNING).write_bytes(damaged)
        with pytest.raises(ConfigError, match=f"{RUNNING}: cannot be read"):
            running_change(tmp_path)
