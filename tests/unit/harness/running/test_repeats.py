"""What is played again needs a machine that stood still, is counted, and has a budget."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import Any

import pytest
from harness.faults.rows import Row, check, repeated
from harness.running.repeats import NOTES, Notes, allowed, counted_on, played, summary, too_many
from harness.running.standstill import LIMIT_S, MACHINE, Gaps, Machine

GOOD = Row("cut", "found after [s]", 0.1, 0.05)
SLOW = Row("cut", "found after [s]", 0.1, 0.2)
WRONG = Row("cut", "lost", 0.0, 1.0, always=True)


class Looks:
    """A machine that stood still for so long [s], whatever the scene."""

    def __init__(self, gap: float) -> None:
        self.gap = gap

    def now(self) -> float:
        """Return the time; nothing here depends on it."""
        return 0.0

    def stood_still(self, since: float) -> float:
        """Return the gap, whatever the time."""
        return self.gap


LATE, IN_TIME = Looks(0.045), Looks(0.0)
WHY = "the machine stood still for 45 ms; "


def script(*outcomes: Any) -> Callable[[], Any]:
    """Return a scene that ends in these ways, one after the other: a text is a failure."""
    coming = iter(outcomes)

    def play() -> Any:
        outcome = next(coming)
        if isinstance(outcome, str):
            raise AssertionError(outcome)
        return outcome

    return play


def ending(outcome: object) -> AbstractContextManager[object]:
    """Expect the failure that an outcome is, or none."""
    failed = isinstance(outcome, str)
    return pytest.raises(AssertionError, match=outcome) if failed else nullcontext()


@pytest.mark.parametrize(
    ("outcomes", "looks", "may", "plays"),
    [
        ((1,), LATE, True, 1),
        (("first", 1), LATE, True, 2),
        (("first", 1), IN_TIME, True, 1),
        (("first", 1), LATE, False, 1),
        (("first", "second", "third", 1), LATE, True, 3),
    ],
    ids=["well", "again", "the software's fault", "a condition of its own", "the third is final"],
)
def test_a_scene_is_played_again_only_where_the_machine_stood_still(
    outcomes: tuple[Any, ...], looks: Looks, may: bool, plays: int
) -> None:
    """Each repeat is noted once, with its reason; played within a test, what is final stays so."""
    for whole in (False, True):
        notes, scene = Notes(), script(*outcomes)

        def once(notes: Notes = notes, scene: Callable[[], Any] = scene) -> Any:
            return played(scene, looks, notes, may_repeat=lambda: may)

        with ending(outcomes[plays - 1]):
            assert (played(once, LATE, notes) if whole else once()) == outcomes[plays - 1]
        assert notes.take() == [WHY + failure for failure in outcomes[: plays - 1]]
        assert notes.take() == [], "each is collected once"


@pytest.mark.parametrize(
    ("error", "again"),
    [
        (TimeoutError("the browser"), True),
        (type("TimeoutExpired", (Exception,), {})("a process"), True),
    ]
    + [(KeyError("a bug"), False)],
)
def test_who_waited_in_vain_is_played_again_and_a_bug_is_not(error: Exception, again: bool) -> None:
    """Playwright, a web socket and a process raise their own words for it."""
    coming = iter((error, None))

    def scene() -> None:
        if (raised := next(coming)) is not None:
            raise raised

    notes = Notes()
    with nullcontext() if again else pytest.raises(KeyError):
        played(scene, LATE, notes)
    assert len(notes.take()) == again


@pytest.mark.parametrize(
    ("outcomes", "looks", "end", "missed"),
    [
        ((SLOW, "in vain", GOOD), LATE, GOOD, [SLOW.text, "not measured: in vain"]),
        ((SLOW, SLOW, SLOW, GOOD), LATE, SLOW, [SLOW.text, SLOW.text]),
        ((WRONG, GOOD), LATE, WRONG, []),
        ((SLOW, GOOD), IN_TIME, SLOW, []),
        (("first", GOOD), IN_TIME, "first", []),
        (("first", "second", "third"), LATE, "third", []),
    ],
    ids=["missed", "the third is final", "never", "in time", "in time, in vain", "in vain"],
)
def test_rows_are_measured_again_only_where_the_machine_stood_still(
    outcomes: tuple[Any, ...], looks: Looks, end: object, missed: list[str]
) -> None:
    """What was missed is told in its order; what may never happen is not tried again."""
    scenario = script(*([each] if isinstance(each, Row) else each for each in outcomes))
    with ending(end):
        assert repeated(scenario, looks=looks) == ([end], [WHY + text for text in missed])


@pytest.mark.parametrize(
    ("rows", "plays"),
    [([WRONG], 1), ([SLOW], 3), ([], 1)],
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
    """A single repeat is allowed in a short run too; the end names each, and says if too many."""
    assert too_many(repeats, scenes) is failed
    names = [f"{number}: late" for number in range(repeats)]
    first, *lines = summary(names, scenes)
    assert first == f"{repeats} repeats in {scenes} scenes, allowed are {allowed(scenes)}"
    assert lines[:repeats] == [f"  {name}" for name in names]
    assert [line[:6] for line in lines[repeats:]] == (["FAILED"] if failed else [])


def test_a_gap_between_two_looks_is_a_standstill() -> None:
    """Up to the limit it is none; what has ended before a scene does not excuse it."""
    gaps = Gaps()
    for now in (1.0, 1.0 + 0.9 * LIMIT_S, 1.1, 1.105, 1.11):
        gaps.look(now)
    assert gaps.longest(0.0, 2.0) == pytest.approx(0.1 - 0.9 * LIMIT_S)
    assert gaps.longest(1.1, 2.0) == 0.0
    assert gaps.longest(0.0, 1.0) == 0.0
    assert gaps.longest(1.05, 1.06) > 0.0, "a scene within a gap"
    assert Machine().stood_still(0.0) == 0.0, "nobody has looked"


def test_parts_of_one_run_count_together(tmp_path: Path) -> None:
    """The budget is that of the whole run: the part that ends last judges it, none before."""
    kept = tmp_path / "count.json"
    assert counted_on(["a"], 170, kept, parts=2) == (["a"], 170, False)
    assert counted_on(["b", "c"], 149, kept, parts=2) == (["a", "b", "c"], 319, True)
    assert too_many(3, 149) and not too_many(3, 319)
    assert (
        summary(["a"], 3, judges=False)[0]
        == "1 repeats in 3 scenes, judged at the end of the last part"
    )
    assert len(summary(["a", "b"], 3, judges=False)) == 3, "no verdict yet"
