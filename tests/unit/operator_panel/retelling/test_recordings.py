"""A recording is read by a program of its own, once, and held while somebody looks at it."""

from __future__ import annotations

import asyncio
import shutil
from collections.abc import Awaitable, Callable, Iterator
from pathlib import Path

import pytest
from harness.page import recorded
from harness.workspace import ROOT
from operator_panel.config import load_surroundings
from operator_panel.retelling.recorded_past import RecordedLook
from operator_panel.retelling.recordings_io import KEPT, Recordings
from operator_panel.retelling.run_folders_io import RunFolderError
from operator_panel.view.frame import FrameMaker
from scara_config import load_robot

from scara_description.urdf import parse_urdf

ROBOT = load_robot()
CONFIG = ROOT / "config"


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Recordings]:
    """Return what holds the recordings of an empty folder."""
    model = parse_urdf(ROBOT.description.read_text(encoding="utf-8"))
    maker = FrameMaker(ROBOT, model, 0.6, load_surroundings(ROBOT, CONFIG).alarm_mm)
    made = Recordings(tmp_path, CONFIG, ROBOT.name, maker, 20.0)
    yield made
    made.close()


def run_of(folder: Path, name: str, robot: str = "") -> Path:
    """Write a recording into a folder of runs."""
    (folder / name).mkdir()
    return recorded.write_recording(folder / name / "run.bag", ROBOT, robot)


def scene(act: Callable[[], Awaitable[None]]) -> None:
    """Run a scene with a deadline."""
    asyncio.run(asyncio.wait_for(act(), 60.0))


async def whole(store: Recordings, run: str, after: float) -> RecordedLook:
    """Ask until the recording is read to its end."""
    while True:
        found = await store.look(run, recorded.START + after)
        if found is not None and found.last >= found.ends:
            return found
        await asyncio.sleep(0.02)


def test_moment_of_a_recording_is_read_and_then_remembered(
    store: Recordings, tmp_path: Path
) -> None:
    """One program reads it once, however often somebody asks."""
    run_of(tmp_path, "mine")

    async def act() -> None:
        found = await whole(store, "mine", 6.0)
        assert found.frame.text["mode"] == "Real robot leads"
        reading = store._held["mine"]
        again = await store.look("mine", recorded.START + 1.0)
        assert again is not None and again.frame.text["mode"] == "Ready"
        assert store._held["mine"] is reading

    scene(act)


def test_recording_of_another_robot_is_refused_with_what_to_do(
    store: Recordings, tmp_path: Path
) -> None:
    """Its numbers would move a robot of other lengths."""
    run_of(tmp_path, "other", "some_other_arm")

    async def act() -> None:
        await whole(store, "other", 0.0)

    with pytest.raises(RunFolderError, match=r"some_other_arm.*SCARA_ROBOT=some_other_arm"):
        scene(act)


def test_recording_that_cannot_be_read_says_why(store: Recordings, tmp_path: Path) -> None:
    """And can be asked for again."""
    (tmp_path / "broken").mkdir()
    (tmp_path / "broken" / "run.bag").write_bytes(b"x" * 2048)

    async def act() -> None:
        await whole(store, "broken", 0.0)

    for _ in range(2):
        with pytest.raises(RunFolderError, match="no readable bag"):
            scene(act)


def test_recording_that_cannot_be_read_says_why_to_each_who_waits(
    store: Recordings, tmp_path: Path
) -> None:
    """The first one who hears of it has it tried again, the second one as well."""
    (tmp_path / "broken").mkdir()
    (tmp_path / "broken" / "run.bag").write_bytes(b"x" * 2048)

    async def act() -> None:
        both = [asyncio.ensure_future(whole(store, "broken", 0.0)) for _ in range(2)]
        for answer in await asyncio.gather(*both, return_exceptions=True):
            assert isinstance(answer, RunFolderError) and "no readable bag" in str(answer)

    scene(act)


def test_who_waits_for_a_recording_that_another_pushed_out_asks_again(
    store: Recordings, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its program ends, though it had not even begun."""
    run_of(tmp_path, "mine")

    async def act() -> None:
        reading = await store._reading("mine")
        store._forget("mine")
        assert reading.task is not None
        await reading.task
        assert reading.past.head is None

        async def waited(run: str) -> object:
            return reading

        monkeypatch.setattr(store, "_reading", waited)
        assert await store.look("mine", 0.0) is None

    scene(act)


@pytest.mark.parametrize(
    "name", ["gone", "", "deep/one", "{here}/deep/one", "../{here.name}/deep/one"]
)
def test_recording_that_is_not_there_is_said(store: Recordings, tmp_path: Path, name: str) -> None:
    """No name leads out of the folder of runs, nor deeper into it, even where a bag is."""
    bag = tmp_path / "deep" / "one" / "run.bag"
    bag.parent.mkdir(parents=True)
    bag.write_bytes(b"x")
    run = name.format(here=tmp_path)
    with pytest.raises(RunFolderError, match="there is no recording"):
        scene(lambda: store.look(run, 0.0))  # type: ignore[arg-type, return-value]


def test_only_some_recordings_are_held(store: Recordings, tmp_path: Path) -> None:
    """The one that nobody asked for the longest goes, and its program with it."""
    bag = run_of(tmp_path, "run_0")
    for number in range(1, KEPT + 1):
        (tmp_path / f"run_{number}").mkdir()
        shutil.copy(bag, tmp_path / f"run_{number}" / "run.bag")

    async def act() -> None:
        await whole(store, "run_0", 0.0)
        for number in range(1, KEPT):
            await store.look(f"run_{number}", 0.0)
        await store.look("run_0", 0.0)
        oldest = store._held["run_1"]
        await store.look(f"run_{KEPT}", 0.0)
        assert set(store._held) == {"run_0", "run_2", f"run_{KEPT}"}
        assert oldest.task is not None
        await oldest.task
        assert oldest.ended
        await whole(store, f"run_{KEPT}", 0.0)

    scene(act)


def test_recording_that_was_replaced_is_read_anew(store: Recordings, tmp_path: Path) -> None:
    """A name may be given again."""
    run_of(tmp_path, "mine")

    async def act() -> None:
        await whole(store, "mine", 6.0)
        shutil.rmtree(tmp_path / "mine")
        with pytest.raises(RunFolderError, match="there is no recording"):
            await store.look("mine", 0.0)
        (tmp_path / "mine").mkdir()
        recorded.write_recording(tmp_path / "mine" / "run.bag", ROBOT, silent=2.0)
        assert "silent" in (await whole(store, "mine", 6.0)).note

    scene(act)
