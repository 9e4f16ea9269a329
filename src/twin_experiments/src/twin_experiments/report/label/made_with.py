"""What a report was made with: the label of its figures, as data and as rows of a table."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Any

from twin_experiments.report.label.plant import RecordedPlant, plant_label

LATER = timedelta(hours=1)
"""A report that follows its recording by more was perhaps made elsewhere."""
NOT_MEASURED = "not measured"


@dataclass(frozen=True)
class Workspace:
    """What the reporting machine says of itself.

    Args:
        commit: Of the workspace, with a plus if files differ, or ``unknown``.
        versions: Of this package, the interpreter and the libraries that decide the figures.
        processor: Its name, or ``unknown``.
        cores: How many there are.
        now: Time of the report, with a time zone.
    """

    commit: str
    versions: Mapping[str, str]
    processor: str
    cores: int
    now: datetime


@dataclass(frozen=True)
class MadeWith:
    """Everything that a figure depends on.

    Args:
        robot: Name in robot.yaml.
        plant: How the stand-in behaved; None if it was not recorded.
        speed_percent: Experiment to the leader's fastest joint, in percent of that joint's largest
            speed; None if it could not be measured.
        configuration: Digest of the recorded configuration, as the twin controller names it;
            empty if none was recorded.
        recorded: When the recording began and ended, with a time zone.
        workspace: Of the machine that writes the report.
    """

    robot: str
    plant: RecordedPlant | None
    speed_percent: Mapping[str, float | None]
    configuration: str
    recorded: tuple[datetime, datetime]
    workspace: Workspace

    def document(self) -> dict[str, Any]:
        """Return the section ``made_with`` of report.json."""
        plant, workspace = self.plant, self.workspace
        return {
            "robot": self.robot,
            "plant": None
            if plant is None
            else {
                "name": plant.name,
                "description": plant.description,
                "payload_kg": plant.payload_kg,
            },
            "speed_percent": {
                name: None if speed is None else round(speed, 1)
                for name, speed in self.speed_percent.items()
            },
            "commit": workspace.commit,
            "versions": dict(workspace.versions),
            "configuration": self.configuration or None,
            "machine": {"processor": workspace.processor, "cores": workspace.cores},
            "date": self.recorded[0].isoformat(timespec="seconds"),
            "reported": workspace.now.isoformat(timespec="seconds"),
        }

    def rows(self) -> list[tuple[str, str]]:
        """Return name and text of each row of the table above the figures."""
        workspace = self.workspace
        differs = " (files differ from it)" if workspace.commit.endswith("+") else ""
        plant = plant_label(self.plant)
        if self.plant is not None:
            plant += f"; payload {self.plant.payload_kg:g} kg"
        speeds = ", ".join(f"{name} {speed_text(one)}" for name, one in self.speed_percent.items())
        cores = "1 core" if workspace.cores == 1 else f"{workspace.cores} cores"
        rows = [
            ("robot", self.robot),
            ("plant", plant),
            ("speed", f"{speeds} (the leader's fastest joint, of its largest speed)"),
            ("commit", workspace.commit + differs),
            ("versions", ", ".join(f"{name} {text}" for name, text in workspace.versions.items())),
            ("configuration", self.configuration or "not recorded"),
            ("machine", f"{workspace.processor}, {cores}"),
            ("date", _moment(self.recorded[0])),
        ]
        if workspace.now - self.recorded[1] > LATER:
            rows.append(
                (
                    "reported",
                    f"{_moment(workspace.now)}; commit, versions and machine are those of the "
                    "report, the recording does not hold its own",
                )
            )
        return rows


def speed_text(percent: float | None) -> str:
    """Return a speed in percent as text."""
    return NOT_MEASURED if percent is None else f"{percent:.0f} %"


def _moment(at: datetime) -> str:
    return at.strftime("%Y-%m-%d %H:%M:%S %Z")
