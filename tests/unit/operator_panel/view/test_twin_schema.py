"""The schema of ``/api/twin``, judged by libraries that know the standards."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import pytest
from harness.page.pair import shadow_document
from jsonschema import Draft202012Validator
from openapi_spec_validator import OpenAPIV31SpecValidator
from operator_panel.view.twin_schema import json_schema, openapi


def pair() -> dict[str, Any]:
    """Return a document as a program gets it."""
    found: dict[str, Any] = json.loads(shadow_document(5.0))
    return found


def test_schema_is_one_of_draft_2020_12() -> None:
    """By its own meta-schema."""
    Draft202012Validator.check_schema(json_schema())


def test_openapi_is_one_of_version_3_1() -> None:
    """By OpenAPI's own schema, references and default values included."""
    faults = list(OpenAPIV31SpecValidator(openapi()).iter_errors())
    assert faults == []


def test_document_is_what_the_schema_says() -> None:
    """With values that are not known yet, too."""
    Draft202012Validator(json_schema()).validate(pair())


def without_a_field(tree: dict[str, Any]) -> None:
    """Take one away."""
    del tree["authority"]["mode"]


def with_a_text(tree: dict[str, Any]) -> None:
    """Put a text where a number was."""
    tree["real"]["position"]["joint_1"] = "1.0"


def with_a_list(tree: dict[str, Any]) -> None:
    """Put a list where names were."""
    tree["twin"]["position"] = [1.0, 2.0]


@pytest.mark.parametrize("spoil", [without_a_field, with_a_text, with_a_list])
def test_another_document_is_refused(spoil: Callable[[dict[str, Any]], None]) -> None:
    """So the schema does tell one from the other."""
    document = pair()
    spoil(document)
    assert not Draft202012Validator(json_schema()).is_valid(document)
