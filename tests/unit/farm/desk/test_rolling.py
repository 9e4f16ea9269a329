"""A roll-out over the bus: two cells that start anew, and what refuses it."""

from __future__ import annotations

import json
import threading
import time
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path

import pytest
from farm.config import load_farm
from farm.desk import command_line_io
from farm.desk.command_line_io import app
from farm.desk.lines import rollout_io as rollout
from farm.desk.roster import Row
from farm.link.cell_link_io import CellLink
from farm.link.changes_io import CellChanges, _looking
from farm.link.rights import CONFIGURING, Rights
from farm.wire import Answer, CellState, Configuration, Level
from harness.processes import wait_until
from harness.yaml_files import CONFIG
from msgspec.structs import replace
from scara_bringup.processes.configuration_io import begin_with_change, copy_with_ports, got_ready
from scara_config.rollout.change import change_of
from scara_config.rollout.kept import apply_change, kept_file
from typer.testing import CliRunner
from unit.farm.conftest import Farm, Journal

from farm import keys

CHANGE = {"name": "settled", "values": {"what_if.yaml": {"uncertainty.table_mm": 0.7}}}
RIGHTS = Rights("watcher", {"watcher": [], "configurer": list(CONFIGURING)}, {"ann": "configurer"})


@dataclass
class Cell:
    """A cell that starts, ends and starts anew, as ``./cell up`` does it."""

    farm: Farm
    name: str
    remote: bool = True
    gets_ready: bool = True
    starts: int = 0
    told: list[str] = field(default_factory=list)
    ends: ExitStack = field(default_factory=ExitStack)

    def start(self) -> None:
        """Start with what is wanted, and join."""
        self.ends.close()
        self.ends, self.starts = ExitStack(), self.starts + 1
        place = self.farm.folder.parent / self.name
        file = kept_file(place, self.name)
        with _looking:
            kept, config = begin_with_change(file, CONFIG), CONFIG
        if kept.wanted is not None:
            config = copy_with_ports(CONFIG, place / f"config_{self.starts}")
            apply_change(kept.wanted, CONFIG, config)
        if not self.gets_ready and kept.wanted is not None:
            return
        got_ready(file)
        changes = CellChanges(file, config, lambda _: [], self._tell)
        session = self.ends.enter_context(self.farm.client())
        link = self.ends.enter_context(
            CellLink(
                session,
                keys.CellName("site", "m", self.name),
                replace(self.farm.config.link, rights=RIGHTS, health_rate_hz=20.0),
                Journal(),
                lambda _: Answer(False, ""),
                changes=changes,
            )
        )
        self._beat(link)

    def _beat(self, link: CellLink) -> None:
        ended = threading.Event()

        def show() -> None:
            count = 0
            while not ended.wait(0.05):
                count += 1
                link.show(CellState(count, time.time(), 1, Level.GOOD, "IDLE", remote=self.remote))

        thread = threading.Thread(target=show)
        thread.start()
        self.ends.callback(thread.join)
        self.ends.callback(ended.set)

    def _tell(self, command: object, answer: Answer) -> None:
        self.told.append(f"{getattr(command, 'command', '')} {answer.accepted}")


@dataclass
class Site:
    """A desk, two cells, and a file with the change."""

    farm: Farm
    cells: list[Cell]
    file: Path

    def asked(self, *words: str, person: str = "ann") -> tuple[int, str]:
        """Return exit code and output of ``./cell farm rollout``."""
        assert rollout.app is app
        port = str(self.farm.config.router.port)
        done = CliRunner().invoke(
            app, ["rollout", *words, "--router-port", port, "--person", person]
        )
        return done.exit_code, done.output

    def started_anew(self, *cells: Cell) -> threading.Thread:
        """Start these cells anew once each has a change that it does not run with."""

        def watch() -> None:
            for cell in cells:
                file = kept_file(self.farm.folder.parent / cell.name, cell.name)
                wait_until(
                    lambda f=file: f.exists() and json.loads(f.read_text())["wanted"] is not None,
                    20.0,
                    f"a change for {cell.name}",
                )
                cell.start()

        thread = threading.Thread(target=watch)
        thread.start()
        return thread


@pytest.fixture
def site(farm: Farm, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Give two cells under one desk."""
    # As patient as the farm: who asks runs in this process too.
    shipped = replace(load_farm(CONFIG), lease_ms=farm.config.lease_ms)
    monkeypatch.setattr(command_line_io, "load_farm", lambda: shipped)
    monkeypatch.setattr(command_line_io, "CONNECT_S", 10.0)
    desk = farm.desk(farm.router())
    cells = [Cell(farm, name) for name in ("a", "b")]
    file = tmp_path / "settled.yaml"
    file.write_text(json.dumps(CHANGE))  # JSON is YAML
    for cell in cells:
        cell.start()
    wait_until(
        lambda: (
            sum(row.configuration is not None and row.state is not None for row in desk.rows())
            == len(cells)
        ),
        20.0,
        "both cells",
    )
    yield Site(farm, cells, file)
    for cell in cells:
        cell.ends.close()


def test_one_cell_gets_it_first_and_the_rest_after_it_has_run(site: Site) -> None:
    """The words are the same for whoever reads along."""
    a, b = site.cells
    thread = site.started_anew(b, a)
    code, said = site.asked(str(site.file), "--first", "b", "--wait", "0.5")
    thread.join()
    assert code == 0, said
    assert "settled: m/b first" in said and "settled: 2 cells run with it" in said
    assert said.index("CONFIGURE m/b") < said.index("CONFIGURE m/a")
    assert (a.starts, b.starts) == (2, 2)
    assert a.told == b.told == ["EXAMINE True", "CONFIGURE True"]
    code, said = site.asked(str(site.file), "--take-back")
    assert code == 0 and said.count("from the next start on: the cell's own files") == 2


def test_a_look_changes_nothing(site: Site) -> None:
    """--check ends after what the cells say."""
    code, said = site.asked(str(site.file), "--check")
    assert code == 0 and said.count("nothing is wrong with it here") == 2
    assert [cell.told for cell in site.cells] == [["EXAMINE True"]] * 2


def test_one_refusal_keeps_it_from_all(site: Site) -> None:
    """A cell whose switch is off, and somebody without the role."""
    site.cells[1].remote = False
    off = "switch of this cell is off"
    wait_until(lambda: off in site.asked(str(site.file), "--check")[1], 20.0, "the switch")
    code, said = site.asked(str(site.file))
    assert code == 1 and "a cell does not take it: nothing was changed" in said
    code, said = site.asked(str(site.file), person="bob")
    assert code == 1 and said.count("bob is watcher here and may only STOP and PAUSE") == 2
    assert "CONFIGURE" not in said


def test_a_cell_that_does_not_get_ready_ends_it(site: Site) -> None:
    """It goes back by itself at the start after that, and the other cell never gets it."""
    a, b = site.cells
    a.gets_ready = False

    def fail_once() -> None:
        site.started_anew(a).join()
        a.start()

    thread = threading.Thread(target=fail_once)
    thread.start()
    code, said = site.asked(str(site.file), "--wait", "0.5")
    thread.join()
    assert code == 1, said
    assert "m/a went back: left settled" in said and "did not get ready with it" in said
    assert b.told == ["EXAMINE True"] and b.starts == 1


def test_a_cell_at_which_it_is_taken_back_ends_it(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Also the first one, before its next start: else nobody would hear of it, without end."""
    change = change_of(CHANGE)
    asked: list[object] = []
    has_it = Configuration(4, "", change.text, proven=False)
    shown = (Configuration(3), Configuration(3), has_it, Configuration(5))
    row = Row("m/a", Level.GOOD, "IDLE", 0.0, "", None, 0.0, 1, 0, 1.0, 20.0)
    rows = ({"m/a": replace(row, configuration=each)} for each in shown)
    monkeypatch.setattr(rollout, "_rows", lambda *_: next(rows))
    monkeypatch.setattr(rollout, "LOOK_S", 0.0)
    cell = keys.CellName("site", "m", "a")

    def offer(names: object, _: object) -> bool:
        asked.append(names)
        return True

    assert not rollout._roll(None, None, [cell], change, 0.0, offer)  # type: ignore[arg-type]
    assert asked == [["m/a"]] and "settled: m/a went back: own files" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("name: x\nvalues: {persons.yaml: {a: 1}}", "persons.yaml: no change from elsewhere"),
        ("name: [", "is no valid YAML"),
        ("[]", "Expected `object`"),
    ],
)
def test_a_wrong_file_is_refused_before_anybody_is_asked(
    tmp_path: Path, text: str, said: str
) -> None:
    """With the file's name; no desk is needed for it."""
    file = tmp_path / "x.yaml"
    file.write_text(text)
    done = CliRunner().invoke(app, ["rollout", str(file)])
    assert done.exit_code == 2 and f"{file}: " in done.output and said in done.output
    assert CliRunner().invoke(app, ["rollout"]).exit_code == 2
