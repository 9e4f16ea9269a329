"""Fit each cell's recordings of a day, and keep what was found for the drift picture.

The desk's data holds both: ``recordings/MACHINE/CELL/...`` as fetched, ``fits/DAY.jsonl`` as found.
"""

from __future__ import annotations

from collections.abc import Callable
from datetime import date
from pathlib import Path

import msgspec
import zenoh
from scara_config import ConfigError

from farm.bus_io import BusError, open_client
from farm.config import load_farm
from farm.desk.commands_io import cells_there
from farm.desk.fetching_io import FetchError, fetch, recordings_of
from farm.desk.fits_io import keep_fits
from farm.fits import DayFit, Fitted, chosen, of_day
from farm.keys import CellName
from farm.lab.places_io import Where, run_plan
from farm.lab.plan import Plan
from farm.lab.running_io import LabError, Result

RECORDINGS = "recordings"
LARGEST = 64_000_000
"""Our choice: a recording of some minutes [bytes]; a fit goes through it 150 times."""
THERE_S = 1.0
WORDS = ("--json",)
"""Of the fit, for its results."""


def fetch_day(
    router_port: int | None, data: Path, day: date, most: int, say: Callable[[str], None]
) -> None:
    """Fetch the recordings of a day that are fitted, of all cells that are there.

    Args:
        router_port: Of the desk; None: as in farm.yaml.
        data: The desk's data.
        day: Which.
        most: So many of each cell.
        say: Is told what could not be fetched: the night goes on without it.

    Raises:
        LabError: farm.yaml cannot be read.
    """
    try:
        config = load_farm()
        router = config.router
        if router_port is not None:
            router = msgspec.structs.replace(router, port=router_port)
        with open_client(router, config.lease_ms, THERE_S) as session:
            for cell in cells_there(session, config.site, THERE_S):
                try:
                    _fetch_of(session, cell, data / RECORDINGS, day, most)
                except FetchError as error:
                    say(str(error))
    except BusError as error:
        say(f"{error}; only recordings that are here already are fitted")
    except ConfigError as error:
        raise LabError(str(error)) from error


def _fetch_of(session: zenoh.Session, cell: CellName, folder: Path, day: date, most: int) -> None:
    """Fetch a cell's recordings of a day that are not here yet.

    Raises:
        FetchError: One cannot be fetched.
    """
    listed = {each.name: each for each in recordings_of(session, cell)}
    known = {name: (each.modified / 1e9, each.size) for name, each in listed.items()}
    for name in chosen(known, day, None, most, LARGEST):
        if ".." in Path(name).parts or Path(name).is_absolute():
            raise FetchError(f"{cell}: {name}: is no name of a recording")
        target = folder / cell.machine / cell.cell / name
        if not target.is_file() or target.stat().st_size != listed[name].size:
            fetch(session, cell, listed[name], target)


def fit_day(
    data: Path, folder: Path, day: date, most: int, at: Where, say: Callable[[str], None]
) -> tuple[Path, list[DayFit]]:
    """Fit the day's recordings that are in the desk's data; return the file and what it holds.

    Args:
        data: The desk's data.
        folder: Of the lab's results.
        day: Which.
        most: So many recordings of each cell.
        at: Where the jobs run.
        say: Is told which recordings say nothing, and why.

    Raises:
        LabError: There is nothing to fit, or it cannot be kept.
    """
    bags = _bags(data / RECORDINGS, day, most)
    if not bags:
        raise LabError(
            f"{data / RECORDINGS}: no recording of {day} of at most {LARGEST / 1e6:.0f} MB: fetch "
            "some (./cell farm fetch), or name another --day"
        )
    results = run_plan(folder, Plan("fit", tuple(map(str, bags)), WORDS), at)
    fits: dict[CellName, list[Fitted]] = {}
    for bag, result in zip(bags.values(), results):
        found = _fitted(result, say)
        if found is not None:
            fits.setdefault(bag, []).append(found)
    days = [of_day(cell.machine, cell.cell, day, found) for cell, found in sorted(fits.items())]
    try:
        return keep_fits(data, day.isoformat(), days), days
    except OSError as error:
        raise LabError(f"{data}: {error.strerror}") from error


def _bags(folder: Path, day: date, most: int) -> dict[Path, CellName]:
    """Return the recordings that are fitted, each with whose it is."""
    bags: dict[Path, CellName] = {}
    for place in sorted(folder.glob("*/*/")):
        cell = CellName("", place.parent.name, place.name)
        known = {
            str(file): (file.stat().st_mtime, file.stat().st_size) for file in place.rglob("*.bag")
        }
        for name in sorted(chosen(known, day, None, most, LARGEST)):
            bags[Path(name).resolve()] = cell
    return bags


def _fitted(result: Result, say: Callable[[str], None]) -> Fitted | None:
    """Return what a fit has found; None: it has found nothing, and that is said."""
    why = f"ended with {result.code}: {' '.join(result.complained.split())[-200:]}"
    if result.code == 0:
        try:
            return msgspec.json.decode(result.said, type=Fitted)
        except msgspec.DecodeError as error:
            why = f"printed no fit: {error}"
    say(f"{result.words[0]}: left out: {why}")
    return None
