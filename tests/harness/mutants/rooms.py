"""The rooms in which mutants are made, and the list of those that no test can kill."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import msgspec
from ruamel.yaml import YAML

from harness.mutants.mutant import Mutant
from harness.sources import SHELLS
from harness.workspace import ROOT

FOLDER = ROOT / "tests" / "mutants"


def is_meant(module: str, pattern: str) -> bool:
    """Return whether a glob means a module that it finds: a shell by the end of its name alone."""
    ends = [end for end in SHELLS if module.endswith(end)]
    return not ends or Path(pattern).stem.endswith(ends[0])


class Room(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Modules and the tests that are to notice their faults; globs from the root.

    A shell is meant only by a glob that ends as its name does.
    """

    modules: list[str]
    tests: list[str]

    def paths(self, root: Path = ROOT) -> list[Path]:
        """Return the modules that hold code."""
        found = {
            path
            for pattern in self.modules
            for path in root.glob(pattern)
            if is_meant(path.stem, pattern)
        }
        return sorted(path for path in found if path.name != "__init__.py")

    def tests_of(self, module: Path) -> list[str]:
        """Return the room's tests, the module's own first, then those of its folder."""
        places = sorted({path for pattern in self.tests for path in ROOT.glob(pattern)})
        files = [
            path
            for place in places
            for path in ([place] if place.is_file() else sorted(place.rglob("test_*.py")))
        ]
        words = module.stem.split("_")
        files.sort(
            key=lambda path: (
                path.stem != f"test_{module.stem}",
                words[0] not in path.stem,
                path.parent.name != module.parent.name,
            )
        )
        return [str(path.relative_to(ROOT)) for path in files]


class Equivalent(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A mutant that changes nothing that the project promises; see equivalent.yaml."""

    path: str
    before: str
    after: str
    reason: str

    def fits(self, mutant: Mutant) -> bool:
        """Return whether it is this one."""
        same = (self.before, self.after) == (mutant.before, mutant.after)
        return same and mutant.path.endswith(self.path)


def load_rooms() -> dict[str, Room]:
    """Read rooms.yaml."""
    return msgspec.convert(YAML(typ="safe").load(FOLDER / "rooms.yaml"), dict[str, Room])


def load_equivalent() -> list[Equivalent]:
    """Read equivalent.yaml; each entry says why."""
    found = YAML(typ="safe").load(FOLDER / "equivalent.yaml")
    return msgspec.convert(found or [], list[Equivalent])


def is_equivalent(mutant: Mutant, known: Sequence[Equivalent]) -> bool:
    """Return whether a mutant is listed."""
    return any(entry.fits(mutant) for entry in known)
