"""The packages: complete manifests, installable nodes, names and sizes that a reader can live with."""

from __future__ import annotations

import os
import re
from collections import Counter
from pathlib import Path

import pytest
from catkin_pkg.package import Package, parse_package
from harness.sources import PACKAGES, Module, imported_names, modules, package_name
from harness.workspace import ROOT

ROS_PACKAGES = {Path(file).parent.name for file in Path("/usr/share").glob("*/package.xml")} | {
    package_name(folder) for folder in PACKAGES
}
VAGUE = re.compile(r"^(utils?|helpers?|common|misc|manager|.*_utils?|.*_helpers?|.*_manager)$")
MODULES = modules()
WITH_NODES = [folder for folder in PACKAGES if (folder / "nodes").is_dir()]


def manifest(folder: Path) -> Package:
    """Read and validate a package.xml."""
    warnings: list[str] = []
    package = parse_package(str(folder), warnings)
    assert warnings == []
    return package


@pytest.mark.parametrize("folder", PACKAGES, ids=package_name)
def test_manifest_is_valid_format_3(folder: Path) -> None:
    """Catkin's own check, without a warning; the package has the name of its room and the project's licence."""
    package = manifest(folder)
    assert package.package_format == 3
    assert package.name == package_name(folder)
    assert package.licenses == ["BSD-3-Clause"] or folder.name == "control_msgs"


def test_all_packages_have_one_version() -> None:
    """They are released together."""
    versions = {package_name(folder): manifest(folder).version for folder in PACKAGES if folder.name != "control_msgs"}
    assert len(set(versions.values())) == 1, versions


@pytest.mark.parametrize("folder", PACKAGES, ids=package_name)
def test_every_import_of_another_package_is_declared(folder: Path) -> None:
    """What a module imports from another ROS package is a dependency in package.xml."""
    package = manifest(folder)
    declared = {d.name for d in (*package.exec_depends, *package.build_depends)} | {package.name}
    missing = {
        f"{name.split('.')[0]} ({module.relative}:{line})"
        for module in MODULES
        if module.package == package.name
        for name, line in imported_names(module.tree)
        if name.split(".")[0] in ROS_PACKAGES - declared
    }
    assert not missing, f"not in {folder.name}/package.xml: {sorted(missing)}"


@pytest.mark.parametrize("folder", WITH_NODES, ids=package_name)
def test_every_node_is_executable_and_installed_with_the_right_interpreter(folder: Path) -> None:
    """catkin_install_python writes the interpreter of the build into the script; `env python3` may be another one."""
    (block,) = re.findall(r"catkin_install_python\(PROGRAMS([^)]*nodes/[^)]*)\)", (folder / "CMakeLists.txt").read_text())
    installed = {word for word in block.split() if word.startswith("nodes/")}
    nodes = {f"nodes/{file.name}" for file in (folder / "nodes").iterdir() if file.is_file()}
    assert installed == nodes
    for node in nodes:
        assert os.access(folder / node, os.X_OK), f"{node} is not executable"
        assert (folder / node).read_text().startswith("#!/usr/bin/env python3\n")


@pytest.mark.parametrize("folder", WITH_NODES, ids=package_name)
def test_node_script_only_calls_main_of_its_module(folder: Path) -> None:
    """nodes/<name> is a few lines; the code is importable as <package>.nodes.<name>."""
    for script in (folder / "nodes").iterdir():
        text = script.read_text()
        assert f"from {package_name(folder)}.nodes.{script.name} import main" in text, script
        assert len(text.splitlines()) <= 10, script
        assert (folder / "src" / package_name(folder) / "nodes" / f"{script.name}.py").is_file(), script


@pytest.mark.parametrize("folder", PACKAGES, ids=package_name)
def test_everything_a_package_installs_exists(folder: Path) -> None:
    """A file named in an install rule that is gone breaks the install space only, where nobody looks."""
    text = (folder / "CMakeLists.txt").read_text()
    for block in re.findall(r"install\((?:FILES|PROGRAMS)([^)]*)\)", text):
        for word in block.split("DESTINATION")[0].split():
            assert (folder / word).is_file(), f"{folder.name}/CMakeLists.txt: {word}"
    for block in re.findall(r"install\(DIRECTORY([^)]*)\)", text):
        for word in block.split("DESTINATION")[0].split():
            assert (folder / word).is_dir(), f"{folder.name}/CMakeLists.txt: {word}"


def test_every_yaml_file_of_the_configuration_is_installed() -> None:
    """A cell in the install space finds the same files."""
    text = (ROOT / "config" / "CMakeLists.txt").read_text()
    assert {file.name for file in (ROOT / "config").glob("*.yaml")} == set(re.findall(r"\w+\.yaml", text))
    assert "install(DIRECTORY robots" in text


@pytest.mark.parametrize("module", MODULES, ids=lambda module: module.relative)
def test_module_has_a_telling_name_and_a_readable_length(module: Module) -> None:
    """No utils, helpers, common, manager; at most 400 lines."""
    assert not VAGUE.match(module.path.stem)
    assert len(module.path.read_text().splitlines()) <= 400


def test_no_folder_holds_more_than_twelve_files_of_a_kind() -> None:
    """A reader sees the whole of a room at a glance."""
    roots = [ROOT / name for name in ("config", "src", "tests", "setup", "docs")]
    files = [file for root in roots for file in root.rglob("*") if file.is_file() and "__pycache__" not in file.parts]
    counts = Counter((file.parent.relative_to(ROOT), file.suffix) for file in files if file.suffix != ".stl")
    assert {f"{folder}/*{suffix}": n for (folder, suffix), n in counts.items() if n > 12} == {}
