"""The farm's desk needs no ROS: a laptop with the libraries is enough."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Iterator

from contract.test_purity import ROS
from harness.sources import imported_names, modules, parsed
from harness.workspace import ROOT

SOURCES = [
    ROOT / "config" / "src",
    *(ROOT / "src" / name / "src" for name in ("farm", "scara_ros")),
]
START = ("farm.__main__", "farm.desk.page_io", "farm.desk.running_io", "farm.desk.reading_io")
MESSAGES = ("scara_msgs", "std_msgs", "sensor_msgs", "std_srvs", "diagnostic_msgs")
FORBIDDEN = {*ROS, *MESSAGES} - {"rospkg"}
"""rospkg is asked only where no folder of settings is given; see the test below."""


def tree_of(name: str) -> ast.Module | None:
    """Return a module of ours by its dotted name; None if it is another's."""
    for folder in SOURCES:
        path = folder.joinpath(*name.split("."))
        for file in (path.with_suffix(".py"), path / "__init__.py"):
            if file.is_file():
                return parsed(file)
    return None


def reached(start: tuple[str, ...]) -> Iterator[tuple[str, str]]:
    """Yield (module of ours, name it imports), over all that is imported, also within functions."""
    waiting, seen = list(start), set(start)
    while waiting:
        name = waiting.pop()
        tree = tree_of(name)
        assert tree is not None or name not in start, f"{name} is no module"
        for imported, _ in imported_names(tree) if tree is not None else ():
            yield name, imported
            for each in (imported, imported.rpartition(".")[0]):
                if each and each not in seen and tree_of(each) is not None:
                    seen.add(each)
                    waiting.append(each)


def test_the_desk_imports_no_ros() -> None:
    """Nothing that it imports does either."""
    found = list(reached(START))
    assert [f"{n} imports {i}" for n, i in found if i.split(".")[0] in FORBIDDEN] == []
    assert {"farm.desk.desk_io", "farm.bus_io", "scara_ros.page.page_door"} <= {n for n, _ in found}


def test_the_walk_sees_ros_where_it_is() -> None:
    """The test above can fail: the link's node imports rospy."""
    assert "rospy" in {imported for _, imported in reached(("farm.link.link_node",))}


def test_the_desk_starts_where_ros_is_blocked(tmp_path: object) -> None:
    """It is imported, its settings are read, and a question is answered, with no ROS to be had."""
    program = f"""
import sys
class Blocked:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in {sorted({*FORBIDDEN, "rospkg"})!r}:
            raise ImportError(f"{{name}} is blocked")
sys.meta_path.insert(0, Blocked())
for name in {START!r}:
    __import__(name)
from farm.desk.command_line_io import app
app(["events", "--folder", {str(tmp_path)!r}], standalone_mode=False)
"""
    environment = {
        "PYTHONPATH": ":".join(map(str, SOURCES)),
        "SCARA_CONFIG_DIR": str(ROOT / "config"),
        "PATH": "/usr/bin:/bin",
        "HOME": str(tmp_path),
    }
    done = subprocess.run(
        [sys.executable, "-c", program], env=environment, capture_output=True, text=True, timeout=60
    )
    assert done.returncode == 0, done.stderr
    assert "0 rows" in done.stdout


def test_every_room_of_the_farm_is_walked() -> None:
    """The desk's modules are all reached from where it starts."""
    desk = {
        module.relative.removeprefix("src/farm/src/").removesuffix(".py").replace("/", ".")
        for module in modules()
        if module.relative.startswith("src/farm/src/farm/desk/") and module.path.stem != "__init__"
    }
    assert desk - {name for pair in reached(START) for name in pair} - set(START) == set()
