"""What this project adds to a run of pytest.

Groups of tests for each worker, and the count of what was played again.
"""

from __future__ import annotations

import contextlib
import gc
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from _pytest.runner import call_and_report
from xdist.scheduler import LoadScopeScheduling

from harness import processes
from harness.running import lanes, repeats, thorough
from harness.running.shared import BROWSERS, GROUP
from harness.workspace import ROOT

REPEAT, SCENE, DEAF = "played again", "scene", "not ended by SIGINT"
COUNT_FILE = "CELL_TEST_COUNT"
"""Environment variable: file in which the parts of one run count together."""
PART = "CELL_TEST_PART"
"""Environment variable: the part of all tests that this run is; without one it is the whole."""


class Groups(LoadScopeScheduling):  # type: ignore[misc]
    """Gives the tests of one group to one worker."""

    def _split_scope(self, nodeid: str) -> str:
        return lanes.group_of(nodeid)


class Running:
    """One run: in a worker it keeps the order, in the process that reports it counts."""

    def __init__(self) -> None:
        """Count from 0."""
        self.repeated: list[str] = []
        self.deaf: list[str] = []
        self.scenes = 0
        self.judges = True
        """This run ends with a verdict on its repeats."""
        self._error: BaseException = AssertionError("no attempt was made")
        self._shared = "PYTEST_XDIST_WORKER" in os.environ
        # Taken away, so that neither workers nor runs within a test count in it.
        self._kept = os.environ.pop(COUNT_FILE, "")
        self._part = os.environ.get(PART, "")
        if self._part not in ("", *lanes.PARTS):
            raise pytest.UsageError(f"{PART}={self._part}: Expected {', '.join(lanes.PARTS)}")

    def pytest_ignore_collect(self, collection_path: Path) -> bool | None:
        """Leave out the files of other parts, and folders that hold no others.

        What conftest.py of such a folder imports takes a second.
        """
        elsewhere = not collection_path.is_relative_to(ROOT)
        if not self._part or elsewhere:
            return None
        if collection_path.suffix == ".py":
            files = [collection_path]
        elif collection_path.is_relative_to(ROOT / "tests") and collection_path.is_dir():
            files = list(collection_path.rglob("test_*.py"))
        else:
            return None
        parts = {lanes.part_of(file.relative_to(ROOT).as_posix()) for file in files}
        return self._part not in parts or None

    @pytest.hookimpl(wrapper=True)
    def pytest_make_collect_report(self, collector: pytest.Collector) -> Iterator[None]:
        """Let a file, which is imported by this, search only in the night whose turn it has."""
        if isinstance(collector, pytest.Module):
            thorough.SEARCH = thorough.searches(collector.nodeid)
        return (yield)

    @pytest.hookimpl(optionalhook=True)
    def pytest_xdist_make_scheduler(self, config: pytest.Config, log: Any) -> Groups:
        """Deal the groups out to the workers."""
        return Groups(config, log)

    @pytest.hookimpl(trylast=True)
    def pytest_collection_modifyitems(
        self, config: pytest.Config, items: list[pytest.Item]
    ) -> None:
        """Put the tests of a group beside each other, so that a shared cell is started once.

        Where several workers share the run, the longest groups begin first. Thorough tests whose
        turn it is not are left to another night.
        """
        later = {
            item
            for item in items
            if item.get_closest_marker("thorough") and not thorough.comes(item.nodeid)
        }
        config.hook.pytest_deselected(items=list(later))
        items[:] = [item for item in items if item not in later]
        if self._shared:
            items.sort(key=lambda item: lanes.place(item.nodeid))
            return
        turns = lanes.turns([item.nodeid for item in items])
        # Nodes of this process come last: rospy gives every new socket a time-out of its own.
        items.sort(
            key=lambda item: (lanes.is_live(item.nodeid), turns[lanes.group_of(item.nodeid)])
        )

    def pytest_collection_finish(self) -> None:
        """Let no collection of garbage look at what lives to the end: a twentieth of the time."""
        gc.collect()
        gc.freeze()
        gc.set_threshold(10_000, 20, 20)

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_protocol(
        self, item: pytest.Item, nextitem: pytest.Item | None
    ) -> bool | None:
        """Play a live test, and again where it failed while the machine stood still.

        Each attempt has fixtures of its own, a module's and the shared cell too: only those of the
        session stay.
        """
        if not lanes.is_live(item.nodeid):
            return None
        item.user_properties.append((SCENE, item.nodeid))
        item.ihook.pytest_runtest_logstart(nodeid=item.nodeid, location=item.location)
        reports: list[pytest.TestReport] = []
        broken: list[pytest.TestReport] = []

        def scene() -> None:
            """Make one attempt, behind the end of the one before."""
            if reports:
                ended = call_and_report(item, "teardown", log=False, nextitem=item.session)
                if ended.failed:  # what an attempt leaves behind has no excuse
                    ended.user_properties.clear()  # the last report counts them
                    broken.append(ended)
                item._initrequest()  # type: ignore[attr-defined]
            reports[:] = [call_and_report(item, "setup", log=False)]
            if reports[0].passed:
                reports.append(call_and_report(item, "call", log=False))
                if reports[1].failed:
                    raise self._error

        with contextlib.suppress(Exception, pytest.fail.Exception):  # its report says it
            repeats.played(scene)
        for report in (*reports, *broken):
            item.ihook.pytest_runtest_logreport(report=report)
        last = item.session.shouldfail or item.session.shouldstop
        call_and_report(item, "teardown", nextitem=None if last else nextitem)
        item._request, item.funcargs = False, None  # type: ignore[attr-defined]
        item.ihook.pytest_runtest_logfinish(nodeid=item.nodeid, location=item.location)
        return True

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_teardown(
        self, item: pytest.Item, nextitem: pytest.Item | None
    ) -> Iterator[None]:
        """End the shared cell with the last test of its group, browsers before others' tests."""
        following = nextitem.nodeid if nextitem is not None else ""
        try:
            return (yield)
        finally:
            if lanes.group_of(following) != lanes.group_of(item.nodeid):
                GROUP.close()
                if not lanes.drives_browser(following.split("::")[0]):
                    BROWSERS.close()

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_makereport(
        self, item: pytest.Item, call: pytest.CallInfo[None]
    ) -> pytest.TestReport | None:
        """Keep why it failed; hand over what was noted meanwhile, with the test's last report.

        That report reaches the process that counts.
        """
        if call.excinfo is not None:
            self._error = call.excinfo.value
        if call.when == "teardown":
            item.user_properties += [(REPEAT, note) for note in repeats.NOTES.take()]
            item.user_properties += [(DEAF, note) for note in processes.DEAF.take()]
        return None

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Count one test."""
        if report.when != "teardown":
            return
        for name, value in report.user_properties:
            self.scenes += name == SCENE
            if name == REPEAT:
                self.repeated.append(f"{report.nodeid}: {value}")
            if name == DEAF:
                self.deaf.append(f"{report.nodeid}: {value}")

    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter) -> None:
        """Print what was played again, and why; and what SIGINT has not ended."""
        if self.scenes or self.repeated:
            terminalreporter.section("scenes in real time")
            for line in repeats.summary(self.repeated, self.scenes, self.judges):
                terminalreporter.line(line)
        if self.deaf:
            terminalreporter.section("processes that SIGINT has not ended")
            for line in self.deaf:
                terminalreporter.line(f"  {line}")

    @pytest.hookimpl(tryfirst=True)
    def pytest_sessionfinish(self, session: pytest.Session) -> None:
        """Fail a run that has used up its budget; of several parts the last one judges."""
        if self._kept:
            self.repeated, self.scenes, self.judges = repeats.counted_on(
                self.repeated, self.scenes, Path(self._kept), len(lanes.PARTS)
            )
        if self.judges and repeats.too_many(len(self.repeated), self.scenes):
            session.exitstatus = session.exitstatus or pytest.ExitCode.TESTS_FAILED
