"""Give every test the built workspace; show what processes printed when a test fails."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest
from harness.ros import Master, Ros, own_master
from harness.running import lanes
from harness.running.plugin import Running
from harness.running.thorough import SEARCH, examples
from harness.workspace import enter_workspace
from hypothesis import HealthCheck, settings
from hypothesis.internal.conjecture import providers

enter_workspace()

# A busy machine is no failure: timing claims live in the benchmark. The same examples each time, so
# that a change that broke nothing is never refused; HYPOTHESIS_SEARCH=1 looks for new ones.
settings.register_profile(
    "cell",
    max_examples=examples(50, 100),
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow],
    derandomize=not SEARCH,
    print_blob=True,  # a failing example of the night says how to repeat it by day
)
settings.load_profile("cell")
if not SEARCH:
    # What the code holds would be drawn with preference: each change of a number would change the
    # examples of all, and each process would read all files for it first.
    providers.is_local_module_file = lambda path: False  # type: ignore[assignment]


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark the tests of slow modules."""
    for item in items:
        if any(part in item.path.as_posix() for part in lanes.SLOW):
            item.add_marker("slow")


def pytest_configure(config: pytest.Config) -> None:
    """Let this run deal out its groups and count its scenes."""
    config.pluginmanager.register(Running(), "scara_running")


@pytest.fixture
def berlin(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Let this machine stand where clocks change twice a year."""
    with monkeypatch.context() as patched:
        patched.setenv("TZ", "Europe/Berlin")
        time.tzset()
        yield
    time.tzset()


@pytest.fixture(scope="session")
def ros_master(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Master]:
    """Start one ROS master for the whole run and make this process its node ``/tests``."""
    with own_master(tmp_path_factory.mktemp("master"), "tests") as master:
        yield master


@pytest.fixture
def ros(ros_master: Master, tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[Ros]:
    """Give one test its own namespace, processes and logs; see tests/ros/conftest.py."""
    with closing(Ros(ros_master, tmp_path, request.node.name)) as handle:
        yield handle


@pytest.fixture(scope="module")
def ros_module(
    ros_master: Master, tmp_path_factory: pytest.TempPathFactory, request: pytest.FixtureRequest
) -> Iterator[Ros]:
    """Give all tests of one module the same namespace and processes.

    For nodes that are slow to start.
    """
    label = request.node.name.rsplit("/", 1)[-1].removesuffix(".py")
    with closing(Ros(ros_master, tmp_path_factory.mktemp(label), label)) as handle:
        yield handle


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_makereport(item: pytest.Item) -> Iterator[None]:
    """Add the last lines of each started process to the report of a failed test."""
    outcome = yield
    report = outcome.get_result()  # type: ignore[attr-defined]
    if not report.failed:
        return
    for value in getattr(item, "funcargs", {}).values():
        stage = getattr(value, "stage", None)
        if stage is not None and stage.processes:
            report.sections.append(("output of the started processes", stage.report()))
