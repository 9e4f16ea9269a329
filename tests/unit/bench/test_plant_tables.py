"""The tables of robots that were made different, on literal results."""

from __future__ import annotations

from typing import Any

from bench.plant_tables import first_table, tables


def trial(variant: str, leader: str, speed: float, **figures: Any) -> dict[str, Any]:
    """Return one trial as in results.json."""
    known = {
        "fastest_percent": 50.4,
        "path_percent": None,
        "lag_ms": None,
        "rest_percent": None,
        "ended": "",
    }
    return {
        "robot": "fanuc_sr6ia",
        "variant": variant,
        "leader": leader,
        "speed_percent": speed,
        **known,
        **figures,
    }


MEASURED = {
    "date": "2026-11-22",
    "commit": "abc1234",
    "trials": [
        trial("as it is", "real_leads", 50.0, path_percent=0.164, lag_ms=-0.3, rest_percent=0.001),
        trial("as it is", "twin_leads", 50.0, path_percent=5.26, lag_ms=22.2, rest_percent=0.012),
        trial("as it is", "real_leads", 100.0, ended="STOPPED: a zone: on the way"),
        trial("lag 88 ms", "real_leads", 50.0, path_percent=0.1, lag_ms=0.2, rest_percent=0.002),
    ],
}


def test_a_path_beyond_the_articles_limit_stands_out() -> None:
    """Bold, as is a trial that came to no figures; what was not run is a dash."""
    lines = tables(MEASURED)
    shown = (
        "0.16 % (50 %), 0 ms; 0.001 % | **5.26 %** (50 %), 22 ms; 0.012 % | **ended** (STOPPED) | -"
    )
    assert f"| as it is | {shown} |" in lines
    assert "| lag 88 ms | 0.10 % (50 %), 0 ms; 0.002 % | - | - | - |" in lines
    assert any("2026-11-22, commit abc1234" in line for line in lines)


def test_the_short_table_has_both_plants_and_the_article() -> None:
    """It comes first; other variants stand below it."""
    lines = first_table(MEASURED)
    assert tables(MEASURED)[2 : 2 + len(lines)] == lines
    assert lines[0].startswith("| robot, stand-in | real leads, article's moves |")
    assert any(line.startswith("| the article | up to 5 %") for line in lines)
    assert any(
        line.startswith(
            "| fanuc_sr6ia, ideal | 0.16 % | **5.26 %** | **ended** (STOPPED) | - | 0.012 % |"
        )
        for line in lines
    )
    assert any(line.startswith("| fanuc_sr6ia, field | - |") for line in lines)
    assert not any("lag 88 ms" in line for line in lines)
