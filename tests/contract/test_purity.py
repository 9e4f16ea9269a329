"""The core of every package is pure.

But in modules named _io or _node nothing touches ROS, the machine or the clock. Of a message
may be used there what is in its definition: constants, and by ``struct_of`` the fields.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator

import pytest
from harness.sources import PACKAGES, SHELLS, Module, dotted, imported_names, modules, package_name

ROS = (
    *("rospy", "roslib", "roslibpy", "rosgraph", "rosgraph_msgs", "rosbag", "rosbags"),
    *("rosservice", "rostopic", "rosnode", "rosparam", "rosmaster", "rospkg"),
    *("message_filters", "dynamic_reconfigure", "actionlib", "tf", "tf2_ros", "genpy"),
)
MACHINE = (
    *("pybullet", "pybullet_data", "pymodbus", "websocket", "websockets", "nicegui"),
    *("playwright", "zenoh", "duckdb", "pyarrow", "dask", "distributed"),
    *("socket", "socketserver", "select", "selectors", "ssl", "http", "urllib", "xmlrpc"),
    *("requests", "aiohttp", "threading", "_thread", "multiprocessing", "concurrent"),
    *("asyncio", "queue", "subprocess", "os", "shutil", "tempfile", "glob", "fileinput", "io"),
)
CLOCK_AND_CHANCE = ("time", "random", "secrets", "uuid")
ROOMS = {package_name(folder) for folder in PACKAGES}
FORBIDDEN = frozenset(ROS + MACHINE + CLOCK_AND_CHANCE)
MESSAGES = re.compile(r"^[a-z0-9_]+_(msgs|srvs)$")
CALLS = frozenset({"open", "input", "print", "exec", "eval", "__import__"})
CLOCK_CALLS = re.compile(r"\b(datetime\.(now|utcnow|today)|date\.today)$")
CHANCE = re.compile(r"^(np|numpy)\.random\.(?!Generator$|BitGenerator$)")
FILES = frozenset(("read_text", "read_bytes", "write_text", "write_bytes", "mkdir", "unlink"))
FILES |= frozenset(("iterdir", "rglob", "exists"))

# Reading and writing configuration files is what scara_config is for.
EXEMPT = {
    "config/src/scara_config/frames.py": {"exists"},
    "config/src/scara_config/palletise.py": {"exists"},
    "config/src/scara_config/readers.py": {"exists", "read_text"},
    "config/src/scara_config/loader.py": {"os", "rospkg", "read_bytes", "exists"},
    "config/src/scara_config/profile.py": {
        *("os", "rospkg", "shutil", "iterdir", "exists", "mkdir", "unlink"),
    },
    "config/src/scara_config/rollout/kept.py": {"tempfile", "mkdir", "is_dir", "read_bytes"},
    "config/src/scara_config/files/whole_file.py": {"os", "tempfile", "unlink"},
    "config/src/scara_config/writer.py": {"io", "os", "read_text", "exists"},
}
# config.py of a package lists a folder of programs or names a file; the loader opens it.
FOLDERS_ARE_LISTED_IN = re.compile(r"(^|/|_)config\.py$")

PURE = [module for module in modules() if module.is_pure]


def holders_of_constants(module: Module) -> set[str]:
    """Return the imported messages of which only constants and the fields' names are used."""
    found = set()
    for node in module.nodes:
        if not isinstance(node, ast.ImportFrom) or not node.module:
            continue
        if not re.fullmatch(r"(scara|industrial)_msgs\.(msg|srv)", node.module):
            continue
        for alias in node.names:
            if only_constants_of(alias.asname or alias.name, module):
                found.add(f"{node.module}.{alias.name}")
    return found


def only_constants_of(name: str, module: Module) -> bool:
    """Return whether ``name`` stands only before a dot and an upper-case name, or in struct_of."""
    uses = allowed = 0
    for node in module.nodes:
        uses += isinstance(node, ast.Name) and node.id == name
        if isinstance(node, ast.Attribute) and node.attr.isupper():
            allowed += isinstance(node.value, ast.Name) and node.value.id == name
        elif isinstance(node, ast.Call) and ast.unparse(node.func) == "struct_of":
            allowed += ast.unparse(node.args[0]) == name
    return uses == allowed


def offences(module: Module) -> Iterator[str]:
    """Yield ``line: what`` for everything that a pure module must not have."""
    allowed = EXEMPT.get(module.relative, set())
    constants = holders_of_constants(module)
    for name, line in imported_names(module.tree):
        top, parts = name.split(".")[0], name.split(".")
        forbidden = top in FORBIDDEN or MESSAGES.match(top)
        if forbidden and top not in allowed and name not in constants:
            yield f"{line}: imports {name}"
        if top in ROOMS and any(part.endswith(SHELLS) for part in parts[1:]):
            yield f"{line}: imports {name} of an outer layer"
    for node in module.nodes:
        if isinstance(node, ast.ImportFrom) and node.level:
            yield f"{node.lineno}: imports relatively, which this test cannot follow"
        if (
            isinstance(node, ast.Call)
            and isinstance(node.func, ast.Name)
            and node.func.id in CALLS - allowed
        ):
            yield f"{node.lineno}: calls {node.func.id}()"
        if isinstance(node, ast.Attribute):
            name = dotted(node)
            if CLOCK_CALLS.search(name) or CHANCE.match(name):
                yield f"{node.lineno}: uses {name}"
            listed = node.attr in ("iterdir", "exists") and FOLDERS_ARE_LISTED_IN.search(
                module.relative
            )
            if node.attr in FILES - allowed and not listed:
                yield f"{node.lineno}: touches a file by {node.attr}"


def test_every_package_with_code_has_pure_modules() -> None:
    """The walk finds what it is meant to find."""
    wanted = {"scara_config", "scara_control", "scara_simulation", "fanuc_emulator"}
    wanted |= {"twin_controller", "twin_experiments", "scara_bringup"}
    assert {module.package for module in PURE} >= wanted


def test_pure_modules_import_no_ros_no_machine_and_no_clock() -> None:
    """`now`, `dt` and random generators are arguments; shells touch the world."""
    assert [f"{module.relative}:{text}" for module in PURE for text in offences(module)] == []


class Written(Module):
    """A module that is in no file."""

    @property
    def tree(self) -> ast.Module:
        """Parse what stands where the package's name would."""
        return ast.parse(self.package)


@pytest.mark.parametrize(
    ("found", "source"),
    [
        (True, "import rospy"),
        (True, "from std_msgs.msg import String"),
        (True, "from scara_msgs.msg import PartEvent\nx = PartEvent()"),
        (True, "from scara_msgs.msg import PartEvent\ndef f(x: PartEvent):\n    return x.kind"),
        (True, "def f():\n    import time"),
        (True, "import os.path"),
        (True, "from scara_control.dynamics.engine_io import x"),
        (True, "from scara_control.kinematics.kinematics_server_node import main"),
        (True, "from . import loader"),
        (True, "import numpy as np\nx = np.random.normal()"),
        (True, "from datetime import datetime\nx = datetime.now()"),
        (True, "x = open('f')"),
        (True, "from pathlib import Path\nx = Path('f').read_text()"),
        # A generator's type is no use of chance, a message's constant is a word.
        (False, "import numpy as np\ndef f(g: np.random.Generator):\n    return g.normal()"),
        (False, "from scara_msgs.msg import PartEvent\nx = PartEvent.PLACED"),
        (False, "from scara_msgs.msg import PartEvent\nclass V(struct_of(PartEvent)): pass"),
    ],
)
def test_walk_finds_what_is_forbidden_and_nothing_else(found: bool, source: str) -> None:
    """The test that guards the core can fail."""
    assert bool(list(offences(Written(source, PURE[0].path)))) is found
