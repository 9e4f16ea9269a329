"""The label of a report: data for programs, rows for readers."""

from __future__ import annotations

import json
from dataclasses import replace
from datetime import datetime, timedelta, timezone

from twin_experiments.report.label.made_with import MadeWith, Workspace
from twin_experiments.report.label.plant import RecordedPlant

BEGUN = datetime(2026, 3, 1, 12, 30, 15, tzinfo=timezone.utc)
ENDED = datetime(2026, 3, 1, 12, 31, tzinfo=timezone.utc)
VERSIONS = {"twin_experiments": "0.1.0", "Python": "3.11.2", "numpy": "1.24.2"}
HERE = Workspace("1234567", VERSIONS, "A Processor", 2, ENDED + timedelta(seconds=5))
SOFT = RecordedPlant("soft", "a soft robot", 1.5)
LABEL = MadeWith(
    "a_robot", SOFT, {"real_leads": 50.04, "twin_leads": None}, "abc", (BEGUN, ENDED), HERE
)


def test_the_data_are_plain_json() -> None:
    """Whoever reads report.json finds what the figures were made with."""
    assert json.loads(json.dumps(LABEL.document())) == {
        "robot": "a_robot",
        "plant": {"name": "soft", "description": "a soft robot", "payload_kg": 1.5},
        "speed_percent": {"real_leads": 50.0, "twin_leads": None},
        "commit": "1234567",
        "versions": VERSIONS,
        "configuration": "abc",
        "machine": {"processor": "A Processor", "cores": 2},
        "date": "2026-03-01T12:30:15+00:00",
        "reported": "2026-03-01T12:31:05+00:00",
    }


def test_the_rows_say_the_same_in_words() -> None:
    """One row for each thing that a figure depends on."""
    assert LABEL.rows() == [
        ("robot", "a_robot"),
        ("plant", "soft: a soft robot; payload 1.5 kg"),
        (
            "speed",
            "real_leads 50 %, twin_leads not measured (the leader's fastest joint, of its "
            "largest speed)",
        ),
        ("commit", "1234567"),
        ("versions", "twin_experiments 0.1.0, Python 3.11.2, numpy 1.24.2"),
        ("configuration", "abc"),
        ("machine", "A Processor, 2 cores"),
        ("date", "2026-03-01 12:30:15 UTC"),
    ]


def test_what_is_not_known_is_said() -> None:
    """A real robot says no plant; an older recording holds no configuration."""
    bare = replace(LABEL, plant=None, configuration="")
    rows = dict(bare.rows())
    assert (rows["plant"], rows["configuration"]) == ("not recorded", "not recorded")
    document = bare.document()
    assert document["plant"] is document["configuration"] is None


def test_a_changed_workspace_is_said() -> None:
    """The commit alone would promise a figure that it does not give."""
    changed = replace(LABEL, workspace=replace(HERE, commit="1234567+", cores=1))
    rows = dict(changed.rows())
    assert rows["commit"] == "1234567+ (files differ from it)"
    assert rows["machine"] == "A Processor, 1 core"


def test_a_report_of_an_old_recording_says_that_the_machine_is_not_the_recording_one() -> None:
    """Commit and machine of today do not explain figures of another day."""
    late = replace(LABEL, workspace=replace(HERE, now=ENDED + timedelta(hours=2)))
    assert dict(late.rows())["reported"] == (
        "2026-03-01 14:31:00 UTC; commit, versions and machine are those of the report, the "
        "recording does not hold its own"
    )
    assert "reported" not in dict(LABEL.rows())
