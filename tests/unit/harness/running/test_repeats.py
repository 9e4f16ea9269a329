"""What is played again needs a machine that stood still, is counted, and has a budget."""

from __future__ import annotations

from pathlib import Path

import pytest
from harness.faults.rows import Row, check
from harness.running.repeats import NOTES, Notes, allowed, counted_on, played, summary, too_many
from harness.running.standstill import LIMIT_S, MACHINE, Gaps, Machine


class Looks:
    """A machine that stood still for so long in each scene, one after the other."""

    def __init__(self, *gaps: float) -> None:
        self._gaps = iter(gaps)

    def now(self) -> float:
        """Begin a scene."""
        return 0.0

    def stood_still(self, since: float) -> float:
        """Return what was planned."""
        return next(self._gaps)


class Scene:
    """A scene that fails so often, then ends well."""

    def __init__(self, failures: int) -> None:
        self.failures, self.plays = failures, 0

    def __call__(self) -> str:
        """Play it once."""
        self.plays += 1
        assert self.plays > self.failures, f"failure {self.plays}"
        return "well"


def test_a_scene_that_ends_well_is_played_once() -> None:
    """Nobody asks how late the machine was."""
    notes, scene = Notes(), Scene(0)
    assert played(scene, Looks(), notes) == "well"
    assert (scene.plays, notes.take()) == (1, [])


def test_a_scene_is_played_again_where_the_machine_stood_still() -> None:
    """The note says for how long, and what failed."""
    notes, scene = Notes(), Scene(1)
    assert played(scene, Looks(0.045), notes) == "well"
    (note,) = notes.take()
    assert note.startswith("the machine stood still for 45 ms; failure 1")
    assert notes.take() == [], "each is collected once"


def test_a_scene_is_final_on_a_machine_that_was_in_time() -> None:
    """Then it is the software that failed."""
    notes, scene = Notes(), Scene(1)
    with pytest.raises(AssertionError, match="failure 1"):
        played(scene, Looks(0.0), notes)
    assert (scene.plays, notes.take()) == (1, [])


def test_a_scene_is_final_where_its_own_condition_does_not_hold() -> None:
    """A cell that lost no link is not begun again, however late the machine was."""
    scene = Scene(1)
    with pytest.raises(AssertionError, match="failure 1"):
        played(scene, Looks(0.1), Notes(), may_repeat=lambda: False)
    assert scene.plays == 1


def test_the_third_failure_is_final() -> None:
    """Two of them are noted."""
    notes, scene = Notes(), Scene(3)
    with pytest.raises(AssertionError, match="failure 3"):
        played(scene, Looks(0.1, 0.1, 0.1), notes)
    assert (scene.plays, len(notes.take())) == (3, 2)


@pytest.mark.parametrize("failures", [1, 3])
def test_what_was_final_within_a_test_is_final_for_the_test(failures: int) -> None:
    """Else three attempts of three would be nine, and a condition of its own would not count."""
    notes, scene = Notes(), Scene(failures)

    def whole() -> None:
        played(scene, Looks(0.1, 0.1, 0.1), notes, may_repeat=lambda: failures > 1)

    with pytest.raises(AssertionError, match=f"failure {failures}"):
        played(whole, Looks(0.1, 0.1, 0.1), notes)
    assert (scene.plays, len(notes.take())) == (failures, failures - 1)


@pytest.mark.parametrize(
    ("rows", "plays"),
    [([Row("f", "m", 1.0, 2.0, always=True)], 1), ([Row("f", "m", 1.0, 2.0)], 3), ([], 1)],
    ids=["what may never happen", "what may be late", "nothing measured"],
)
def test_a_row_that_is_broken_for_good_is_not_excused_by_the_test_around_it(
    rows: list[Row], plays: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """However late the machine was; what was measured again is counted though it failed."""
    monkeypatch.setattr(MACHINE, "stood_still", lambda since: 0.1)
    measured: list[int] = []

    def measure() -> list[Row]:
        measured.append(1)
        return rows

    with pytest.raises(AssertionError):
        played(lambda: check(measure))
    assert (len(measured), len(NOTES.take())) == (plays, plays - 1)


@pytest.mark.parametrize(
    ("repeats", "scenes", "failed"),
    [(0, 0, False), (1, 1, False), (2, 99, True), (2, 100, False), (5, 250, False), (6, 250, True)],
)
def test_a_run_may_repeat_two_percent_of_its_scenes(
    repeats: int, scenes: int, failed: bool
) -> None:
    """A single repeat is allowed in a short run too."""
    assert too_many(repeats, scenes) is failed
    assert (repeats <= allowed(scenes)) is not failed


def test_the_end_of_a_run_names_each_repeat_and_says_when_there_were_too_many() -> None:
    """The reader sees what was played again, why, and what is allowed."""
    assert summary([], 250) == ["0 repeats in 250 scenes, allowed are 5"]
    lines = summary(["a: late", "b: late"], 10)
    assert lines[:3] == ["2 repeats in 10 scenes, allowed are 1", "  a: late", "  b: late"]
    assert lines[3].startswith("FAILED")


def test_a_gap_between_two_looks_is_a_standstill() -> None:
    """Up to the limit it is none; what has ended before a scene does not excuse it."""
    gaps = Gaps()
    for now in (1.0, 1.0 + 0.9 * LIMIT_S, 1.1, 1.105, 1.11):
        gaps.look(now)
    assert gaps.longest(0.0, 2.0) == pytest.approx(0.1 - 0.9 * LIMIT_S)
    assert gaps.longest(1.1, 2.0) == 0.0
    assert gaps.longest(0.0, 1.0) == 0.0
    assert gaps.longest(1.05, 1.06) > 0.0, "a scene within a gap"


def test_nobody_looks_before_somebody_asks() -> None:
    """A run of pure tests has no thread for it."""
    machine = Machine()
    assert machine.stood_still(0.0) == 0.0
    assert machine.now() <= machine.now()


def test_parts_of_one_run_count_together(tmp_path: Path) -> None:
    """A part with few scenes has the budget of the whole run up to there."""
    kept = tmp_path / "count.json"
    assert counted_on(["a"], 170, kept) == (["a"], 170)
    repeated, scenes = counted_on(["b", "c"], 149, kept)
    assert (repeated, scenes) == (["a", "b", "c"], 319)
    assert not too_many(len(repeated), scenes)
    assert too_many(len(repeated), 149)
