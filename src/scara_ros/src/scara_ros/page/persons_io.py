"""The persons of persons.yaml, and how they prove who they are.

A token is read from the environment or from a file of its owner, never from persons.yaml.
"""

from __future__ import annotations

import hmac
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

from msgspec import Meta, Struct
from scara_config import ConfigError, load, locate
from scara_config.quantities import PersonName, ShortText, VariableName

from scara_ros.page.page_token_io import page_token, ros_home
from scara_ros.page.token_file_io import TokenError

LONGEST = 40
"""Of a name that somebody gives, so much is repeated."""


class Person(Struct, frozen=True, forbid_unknown_fields=True):
    """Where a person's token stands, and the role at the gateway of who brings it.

    ``local``: programs of the cell's machine without a token are this person's own.
    """

    token_environment: VariableName
    token_file: ShortText | None
    gateway_role: ShortText
    local: bool = False


class PersonsFile(Struct, frozen=True, forbid_unknown_fields=True):
    """persons.yaml."""

    persons: Annotated[dict[PersonName, Person], Meta(min_length=1)]


def load_persons(directory: Path | str | None = None) -> dict[str, Person]:
    """Read persons.yaml of ``directory`` (default: the package scara_config).

    Raises:
        ConfigError: The file is missing or wrong.
    """
    path = locate("persons.yaml", directory)
    persons = load(path, PersonsFile).persons
    local = [name for name, person in persons.items() if person.local]
    if len(local) > 1:
        raise ConfigError(f"{path}: local of {', '.join(local)}: allowed for one person")
    if local and persons[local[0]].token_file is None:
        raise ConfigError(f"{path}: persons.{local[0]}.local: needs a token_file")
    return persons


def person_token(person: Person) -> str:
    """Return a person's token; empty if it stands nowhere.

    Raises:
        TokenError: Its file cannot be used, or it is too short.
    """
    if person.token_file is not None:
        return page_token(person.token_environment, ros_home() / person.token_file)
    if os.environ.get(person.token_environment):
        return page_token(person.token_environment, ros_home())
    return ""


def person_tokens(persons: Mapping[str, Person]) -> dict[str, str]:
    """Return the token by name of those who have one.

    Raises:
        TokenError: A token cannot be used, or two persons have the same.
    """
    found: dict[str, str] = {}
    for name, person in persons.items():
        token = person_token(person)
        if not token:
            continue
        if token in found.values():
            raise TokenError(f"{name} has the token of somebody else: give each person one")
        found[name] = token
    return found


class Persons:
    """Says whether somebody is the person that is named. Not for one thread only."""

    def __init__(self, persons: Mapping[str, Person]) -> None:
        """Read all tokens; ``trouble`` says which could not be read."""
        self._persons = dict(persons)
        self._tokens: dict[str, str] = {}
        self.trouble = self.read()

    @property
    def local(self) -> str:
        """Whose own the programs of this machine are; empty: nobody's."""
        return next((name for name, person in self._persons.items() if person.local), "")

    def read(self) -> str:
        """Read the tokens again; return why one cannot be read, or an empty text."""
        try:
            self._tokens = person_tokens(self._persons)
        except TokenError as error:
            return str(error)
        return ""

    def unproven(self, name: str, token: str, read: bool = True) -> str:
        """Return why ``name`` is not proven, or an empty text.

        Args:
            name: A name of persons.yaml; empty: no person, which needs no proof.
            token: What was given as the proof.
            read: A file may be read again. False where nothing may wait for a disk.
        """
        if not name:
            return "a token without a person: give the person's name too" if token else ""
        shown = name[:LONGEST]
        if name not in self._persons:
            known = ", ".join(self._persons)
            return f"person {shown!r} is not in persons.yaml: known are {known}"
        # It may have been made anew since; the one before is good no more then.
        if read:
            self.trouble = self.read()
        known = self._tokens.get(name, "")
        if not known:
            return f"no token of {shown} is known here: {self.trouble or self._place(name)}"
        if hmac.compare_digest(known.encode(), token.encode()):
            return ""
        return f"wrong token of {shown}: {self._place(name)}"

    def _place(self, name: str) -> str:
        person = self._persons[name]
        place = f"the environment variable {person.token_environment}"
        if person.token_file is not None:
            place += f", else the file {ros_home() / person.token_file}"
        return f"it stands in {place} of the twin controller"
