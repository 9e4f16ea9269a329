"""The packages: complete manifests, installable nodes, readable names and sizes.

Each test is one rule over all packages and lists everything that breaks it.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from pathlib import Path

from catkin_pkg.package import InvalidPackage, Package, parse_package
from harness.sources import PACKAGES, imported_names, modules, package_name, started_by
from harness.workspace import ROOT

ROS_PACKAGES = {Path(file).parent.name for file in Path("/usr/share").glob("*/package.xml")} | {
    package_name(folder) for folder in PACKAGES
}
VAGUE = re.compile(r"^(utils?|helpers?|common|misc|manager|.*_utils?|.*_helpers?|.*_manager)$")
MODULES = modules()
WITH_NODES = [folder for folder in PACKAGES if (folder / "nodes").is_dir()]
LONGEST_MODULE = 400
LONGEST_SCRIPT = 10


def manifest(folder: Path) -> Package:
    """Read a package.xml; warnings are no matter here."""
    return parse_package(str(folder), [])


def unsound(folder: Path) -> Iterator[str]:
    """Yield what is wrong with a package.xml."""
    warnings: list[str] = []
    try:
        package = parse_package(str(folder), warnings)
    except InvalidPackage as error:
        yield f"{folder.name}: {error}"
        return
    yield from (f"{folder.name}: {warning}" for warning in warnings)
    if package.package_format != 3:
        yield f"{folder.name}: format {package.package_format}"
    if package.name != package_name(folder):
        yield f"{folder.name}: is called {package.name}"
    if package.licenses != ["BSD-3-Clause"] and folder.name != "control_msgs":
        yield f"{folder.name}: licence {package.licenses}"


def test_manifests_are_valid_format_3() -> None:
    """Catkin's own check, without a warning; each has the name of its room and our licence."""
    assert [text for folder in PACKAGES for text in unsound(folder)] == []


def test_all_packages_have_one_version() -> None:
    """They are released together."""
    versions = {
        package_name(folder): manifest(folder).version
        for folder in PACKAGES
        if folder.name != "control_msgs"
    }
    assert len(set(versions.values())) == 1, versions


def undeclared(folder: Path) -> Iterator[str]:
    """Yield the imports of ROS packages that a package.xml does not name."""
    package = manifest(folder)
    declared = {d.name for d in (*package.exec_depends, *package.build_depends)} | {package.name}
    for module in MODULES:
        if module.package != package.name:
            continue
        for name, line in imported_names(module.tree):
            if name.split(".")[0] in ROS_PACKAGES - declared:
                yield f"{module.relative}:{line}: {name.split('.')[0]}"


def test_every_import_of_another_package_is_declared() -> None:
    """What a module imports from another ROS package is a dependency in package.xml."""
    assert [text for folder in PACKAGES for text in undeclared(folder)] == []


def uninstalled(folder: Path) -> Iterator[str]:
    """Yield the nodes that are not installed with the right interpreter, or are no executables."""
    (block,) = re.findall(
        r"catkin_install_python\(PROGRAMS([^)]*nodes/[^)]*)\)",
        (folder / "CMakeLists.txt").read_text(),
    )
    installed = {word for word in block.split() if word.startswith("nodes/")}
    nodes = {f"nodes/{file.name}" for file in (folder / "nodes").iterdir() if file.is_file()}
    yield from (f"{folder.name}/{node}: installed or there, not both" for node in installed ^ nodes)
    for node in sorted(nodes):
        if not os.access(folder / node, os.X_OK):
            yield f"{folder.name}/{node}: is not executable"
        if not (folder / node).read_text().startswith("#!/usr/bin/env python3\n"):
            yield f"{folder.name}/{node}: another first line"


def test_every_node_is_executable_and_installed_with_the_right_interpreter() -> None:
    """catkin_install_python writes the build's interpreter; `env python3` may be another one."""
    assert [text for folder in WITH_NODES for text in uninstalled(folder)] == []


def overgrown(folder: Path) -> Iterator[str]:
    """Yield the node scripts that do more than to call their module's main."""
    for script in sorted((folder / "nodes").iterdir()):
        text = script.read_text()
        started = started_by(script)
        module = folder / "src" / f"{started.replace('.', '/')}.py"
        if not (started.endswith(f".{script.name}_node") and module.is_file()):
            yield f"{folder.name}/nodes/{script.name}: calls no main of its module"
        if len(text.splitlines()) > LONGEST_SCRIPT:
            yield f"{folder.name}/nodes/{script.name}: {len(text.splitlines())} lines"


def test_node_scripts_only_call_main_of_their_module() -> None:
    """nodes/<name> is a few lines; the code is importable as <name>_node."""
    assert [text for folder in WITH_NODES for text in overgrown(folder)] == []


def absent(folder: Path) -> Iterator[str]:
    """Yield what the install rules name and is not there."""
    text = (folder / "CMakeLists.txt").read_text()
    for rule, is_there in (("(?:FILES|PROGRAMS)", Path.is_file), ("DIRECTORY", Path.is_dir)):
        for block in re.findall(rf"install\({rule}([^)]*)\)", text):
            for word in block.split("DESTINATION")[0].split():
                if not is_there(folder / word):
                    yield f"{folder.name}/CMakeLists.txt: {word}"


def test_everything_a_package_installs_exists() -> None:
    """A missing file in an install rule breaks only the install space, where nobody looks."""
    assert [text for folder in PACKAGES for text in absent(folder)] == []


def test_every_yaml_file_of_the_configuration_is_installed() -> None:
    """A cell in the install space finds the same files."""
    text = (ROOT / "config" / "CMakeLists.txt").read_text()
    assert {file.name for file in (ROOT / "config").glob("*.yaml")} == set(
        re.findall(r"\w+\.yaml", text)
    )
    assert "install(DIRECTORY farm robots" in text


def test_rospack_and_catkin_look_into_the_packages_alone() -> None:
    """The root is the source space: what is no package below it says so, what is built too."""
    folders = [entry for entry in ROOT.iterdir() if entry.is_dir() and entry.name[0] != "."]
    looked_into = {entry.name for entry in folders if not (entry / "CATKIN_IGNORE").exists()}
    assert looked_into == {"config", "src"}


def test_modules_have_telling_names_and_a_readable_length() -> None:
    """No utils, helpers, common, manager; at most 400 lines."""
    vague = [module.relative for module in MODULES if VAGUE.match(module.path.stem)]
    lengths = {module.relative: len(module.path.read_text().splitlines()) for module in MODULES}
    long = [f"{name}: {lines}" for name, lines in lengths.items() if lines > LONGEST_MODULE]
    assert vague + long == []
