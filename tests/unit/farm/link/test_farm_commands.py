"""Commands of the farm are judged at the cell."""

from __future__ import annotations

import dataclasses
import math
import re
from pathlib import Path

import pytest
from farm.config import load_farm
from farm.link.commands import MOST_SEEN, CommandRules, caller_id, judge
from farm.link.rights import ALWAYS, GUARDED, Rights
from farm.wire import Command
from harness.workspace import ROOT
from harness.yaml_files import changed_yaml, copy_configuration
from msgspec.structs import replace
from scara_config import ConfigError

NOW = 1_000_000.0
RIGHTS = Rights("watcher", {"watcher": [], "mover": list(GUARDED)}, {"ann": "mover"})
DIFFERENCES = (-3600.0, -60.0, -2.1, -0.06, 0.0, 0.06, 0.6, 2.1, 60.0, 3600.0)
"""How far a desk's clock is ahead of the cell's [s]."""
OPEN = CommandRules(RIGHTS, remote=True, revision=7, seen={})
GOOD = Command("id1", "RESUME", "ann", "desk_1", NOW + 1.0, revision=7)


def refused(command: Command, guard: CommandRules = OPEN) -> str:
    """Return why a command is refused; empty: it is not."""
    return judge(command, guard, NOW)[0]


@pytest.mark.parametrize(
    ("change", "guard", "said"),
    [
        ({"person": "bob"}, {}, "bob is watcher here and may only STOP and PAUSE"),
        ({}, {"remote": False}, "the remote switch of this cell is off"),
        ({"revision": None}, {}, "names no state that it is based on"),
        ({"revision": 6}, {}, r"the cell has changed since \(state 7, not 6\): look again"),
        ({"expires": NOW - 0.8}, {}, "RESUME expired 0.8 s ago: ask again"),
        ({"expires": NOW + 60.0}, {}, "expires in 60.0 s: allowed are 2 s: ask again"),
        (
            {"expires": NOW + 62.0, "asked": NOW + 60.0},
            {},
            r"by its time of asking, desk_1's clock is 60.0 s ahead of this cell's. Set the clocks",
        ),
        (
            {"expires": NOW + 2.6, "asked": NOW + 0.6},
            {},
            r"clock is 0.6 s ahead of this cell's. Set",
        ),
        (
            {"expires": NOW - 0.1, "asked": NOW - 0.9},
            {},
            r"desk_1's clock is 0.9 s behind this cell's, or it was on its way for as long. Set",
        ),
        ({"expires": math.nan}, {}, "expired"),
        ({"command": "MOVE"}, {}, "MOVE: the farm may not ask for this"),
        ({"command": "x" * 500}, {}, "^x{63}: the farm may not"),
        ({"person": "ann@home"}, {}, "person = 'ann@home': allowed are 1 to 63"),
        ({"person": "x" * 500}, {}, "^person = 'x{63}': allowed are 1 to 63"),
        ({"desk": "a/../b"}, {}, "desk = 'a/../b'"),
        ({"id": ""}, {}, "id = ''"),
        ({}, {"seen": {"id1": NOW + 1.0}}, "taken already: a command is never repeated"),
    ],
)
def test_each_reason_is_told(change: dict, guard: dict, said: str) -> None:
    """Who is refused can do something about it."""
    assert re.search(said, refused(replace(GOOD, **change), dataclasses.replace(OPEN, **guard)))


@pytest.mark.parametrize("difference", DIFFERENCES)
@pytest.mark.parametrize("command", ALWAYS)
def test_a_stop_is_taken_whatever_the_clocks_show(command: str, difference: float) -> None:
    """By a desk ahead or behind, in time or late, once or again, by anybody: it never hurts."""
    asked = NOW + difference
    stop = Command("id2", command, "nobody", "desk_1", asked + 2.0, asked=asked)
    guard = CommandRules(RIGHTS, remote=False, revision=7, seen={})
    for now in (NOW, NOW + 0.5, NOW + 7200.0):
        why, seen = judge(stop, guard, now)
        assert why == "" and seen == guard.seen


@pytest.mark.parametrize("difference", DIFFERENCES)
@pytest.mark.parametrize("command", GUARDED)
def test_a_guarded_command_is_taken_only_by_clocks_that_agree(
    command: str, difference: float
) -> None:
    """Whoever is refused for a clock is told how far it is away."""
    asked = NOW + difference
    why = refused(replace(GOOD, command=command, asked=asked, expires=asked + 2.0))
    # A desk's clock that is behind takes from the time that a command has.
    assert (why == "") == (-2.0 <= difference <= 0.5)
    if why:
        assert f"desk_1's clock is {abs(difference):.1f} s " in why


def test_a_command_is_remembered_beside_those_that_come_after_it() -> None:
    """A stored command that is sent again between others is no new one."""
    asked = [replace(GOOD, id=f"id{k}", expires=NOW + 2.0) for k in range(3)]
    guard = OPEN
    for command, at in zip(asked, (0.0, 0.1, 2.0)):
        why, seen = judge(command, guard, NOW + at)
        assert not why
        guard = CommandRules(RIGHTS, remote=True, revision=7, seen=seen)
    for command in asked:
        assert "taken already" in judge(command, guard, NOW + 2.0)[0]


@pytest.mark.parametrize(("ahead", "taken"), [(2.0, True), (2.49, True), (2.51, False)])
@pytest.mark.parametrize("command", GUARDED)
def test_no_guarded_command_may_be_kept_on_its_way_for_longer_than_two_seconds(
    command: str, ahead: float, taken: bool
) -> None:
    """But for the half second by which two clocks that agree may differ."""
    why = refused(replace(GOOD, command=command, expires=NOW + ahead))
    assert (why == "") is taken


@pytest.mark.parametrize(
    ("path", "value", "said"),
    [
        (["default_role"], "boss", "default_role = boss: allowed are the roles watcher, mover"),
        (["persons"], {"ann": "boss"}, "persons.ann = boss: allowed are the roles watcher"),
        (["roles", "mover"], ["RESUME", "JOG"], "roles.mover = JOG: allowed are RESUME, RESET"),
        (["person"], {}, r"= \{.*: Object contains unknown field `person`"),
    ],
)
def test_a_right_that_names_nothing_is_refused_at_the_start(
    tmp_path: Path, path: list[str | int], value: object, said: str
) -> None:
    """With file, key, value and what is allowed."""
    file = copy_configuration(tmp_path) / "farm" / "farm.yaml"
    changed_yaml(file, file.parent, ["link", "rights", *path], value)
    with pytest.raises(ConfigError, match=f"farm.yaml: link.rights.{said}"):
        load_farm(tmp_path)


def test_a_refused_command_is_not_taken_later() -> None:
    """The switch is turned on a moment later: the old question stays refused."""
    _, seen = judge(GOOD, CommandRules(RIGHTS, remote=False, revision=7, seen={}), NOW)
    assert (
        "taken already"
        in judge(GOOD, CommandRules(RIGHTS, remote=True, revision=7, seen=seen), NOW + 0.1)[0]
    )


@pytest.mark.parametrize("command", ["RESUME", "ALIGN", "MOVE"])
@pytest.mark.parametrize("back", [0.0, 1.0, 3600.0, -3600.0])
def test_what_was_recorded_is_refused_when_it_is_played_again(command: str, back: float) -> None:
    """By whatever the cell's clock was set back or ahead meanwhile."""
    asked = replace(GOOD, command=command)
    _, seen = judge(asked, OPEN, NOW)
    # Others were taken since, so that what had expired could have been forgotten.
    for k in range(100):
        now = NOW + 10.0 + k
        _, seen = judge(
            replace(GOOD, id=f"x{k}", expires=now + 1.0),
            CommandRules(RIGHTS, remote=False, revision=0, seen=seen),
            now,
        )
    for after in (0.0, 0.5, 2.0, 5.0, 110.0):
        assert judge(
            asked, CommandRules(RIGHTS, remote=True, revision=7, seen=seen), NOW + after - back
        )[0]


def test_memory_for_ids_is_bounded_and_keeps_what_has_not_expired() -> None:
    """The oldest that have expired go first; of the others none, however many come after it."""
    seen = {"young": NOW + 1.0} | {f"old{k}": NOW - 1.0 for k in range(MOST_SEEN - 3)}
    for k in range(10):
        guard = CommandRules(RIGHTS, remote=False, revision=0, seen=seen)
        seen = dict(judge(replace(GOOD, id=f"new{k}"), guard, NOW)[1])
    assert len(seen) == MOST_SEEN + 1 and "young" in seen and "new0" in seen and "old0" not in seen


def test_shipped_rights_never_move_a_cell() -> None:
    """By default the farm may stop, never move."""
    rights = load_farm(ROOT / "config").link.rights
    guard = CommandRules(rights, remote=True, revision=7, seen={})
    for command in GUARDED:
        assert "may only STOP and PAUSE" in refused(replace(GOOD, command=command), guard)


def test_caller_holds_person_and_desk() -> None:
    """As audit, decisions and bag show it."""
    assert caller_id(GOOD) == "/farm/ann@desk_1"
