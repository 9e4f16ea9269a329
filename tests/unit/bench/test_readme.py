"""The figures of README.md: what its script writes, and that it has written them."""

from __future__ import annotations

from typing import Any

import pytest

from bench import first_start, page
from bench.readme import demo_sentence, drawn_sentence, start_sentence, with_figures

NAMES = ("figures", "first start")
BLOCKS = "".join(
    f"<!-- {name}: by a script -->\nold\n<!-- end of {name} -->\nkept\n" for name in NAMES
)
TOLD = {"date": "2026-01-02", "commit": "abc1234", "machine": "a machine, 2 cores, 24 GB, Debian"}


def series(**changed: Any) -> dict[str, Any]:
    """Return a series of one run."""
    one = {"path_percent": 0.2, "positioning_percent": 0.01, "true_percent": None}
    one |= {"speed_percent": 50.5}
    worse = one | {"path_percent": 0.594, "true_percent": 0.0221, "speed_percent": 63.7}
    made = {"series": "kit_drawn_50", "robot": "a robot", "plant": "plant field: late", **TOLD}
    made |= {
        "asked_percent": 100.0,
        "failed": 0,
        "runs": [{"real_leads": worse, "twin_leads": one}],
    }
    return made | changed


def test_figures_of_the_readme_are_those_of_the_results() -> None:
    """One source: what stands in README.md is what its script would write now, labels included."""
    text = page.README.read_text()
    assert with_figures(text, page.so_far()) == text


def test_only_the_blocks_of_the_readme_are_written_anew() -> None:
    """What stands around them is a person's."""
    text = with_figures(BLOCKS, {"demos": [series()]})
    assert "old" not in text and text.count("kept\n") == len(NAMES)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("count", [0, 2])
def test_a_readme_without_its_blocks_is_refused(name: str, count: int) -> None:
    """Figures that are written nowhere would be lost in silence."""
    own = f"<!-- {name}: by a script -->\nold\n<!-- end of {name} -->\n"
    with pytest.raises(ValueError, match=rf"README\.md has {count} blocks of {name}, expected 1"):
        with_figures(BLOCKS.replace(own, count * own), {})


@pytest.mark.parametrize("known", [[], [series(runs=[])], [series(series="ideal_50")]])
def test_without_a_run_of_the_hardest_series_no_figure_is_told(known: list[Any]) -> None:
    """Those of an easier series would flatter."""
    assert demo_sentence(known) == "No demo ended with a report."


def test_the_worst_is_told_with_and_without_pauses_of_the_machine() -> None:
    """The first is what happened, the second is what the cell can help."""
    (run,) = series()["runs"]
    paused = {name: one | {"undisturbed_percent": 0.3} for name, one in run.items()}
    said = "worst 0.59 %, 0.30 % where the machine did not stand still;"
    assert said in demo_sentence([series(runs=[paused])])
    assert "worst 0.59 %; " in demo_sentence([series()])


def test_a_first_start_is_told_by_the_slower_person() -> None:
    """As root and as a user with sudo; what was not measured is told too."""
    told = (
        "took 101.24 s\nfresh_machine: as root: exit code 0 after 103 s, 2040 MB more on the disk\n"
        "took 99.0 s\nfresh_machine: as person: exit code 0 after 99 s, 2055 MB more on the disk\n"
    )
    found = first_start.figures(told)
    assert found == {"setup_s": 101.24, "added_mb": 2055}
    rows = [{"id": "start", "ours": 2.578, **TOLD}]
    text = start_sentence({"first_start": found | TOLD | {"load_before": 0.4}, "rows": rows})
    assert "101 s and 2.1 GB" in text and "ready after 2.6 s" in text and "load" not in text
    busy = start_sentence({"first_start": found | TOLD | {"load_before": 6.8}})
    assert "from a mirror nearby, beside other work (load 6.8). Measured" in busy
    assert text.count("commit abc1234") == 2
    assert "not measured" in start_sentence({})


def test_a_first_start_that_was_cut_off_gives_no_figure() -> None:
    """Half a machine is no measurement."""
    with pytest.raises(RuntimeError, match="printed 1 times and 0 sizes"):
        first_start.figures("took 101.24 s\n")


def test_drawn_robots_are_told_by_median_and_worst_of_all() -> None:
    """A trial that came to no end is told beside the worst of the others, and counts as one."""
    trials = [
        {
            "robot": robot,
            "column": words,
            "speed_percent": speed,
            "path_percent": value,
            "ended": "" if value else "PAUSED: x",
        }
        for words in ("real leads", "twin leads, PR[1] alone", "twin leads, ring")
        for speed in (50.0, 100.0)
        for robot, value in (("a", 0.1), ("b", 0.2), ("b", None if speed > 50.0 else 0.4))
    ]
    told = {"trials": trials, "count": 3, "date": "2026-11-26", "commit": "abc"}
    (text,) = drawn_sentence({"draws": told})
    assert text.count("0.20 / 0.40 %, at full speed 0.20 / 0.20 % and 1 that did not end") == 3
    assert "3 robots drawn of each of 2 kinds" in text and not drawn_sentence({})
