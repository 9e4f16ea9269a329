"""Parameters travel as JSON text; what cannot be is refused with the reason."""

from __future__ import annotations

import json
import re
import xmlrpc.client
from typing import Any

import pytest
from harness.opponents.graph_and_clients import Parameters
from rosbridge_gateway.rosapi import parameters
from rosbridge_gateway.rosapi.errors import RequestError

NOTHING = f"[{'null, ' * 20}null]"
DEEP = "[" * 10_000


@pytest.mark.parametrize(
    "value", [5, 0.25, True, "a text", '"quoted"', [1, "two", [3.0]], {"p": {"i": 1}, "d": []}]
)
def test_what_is_set_comes_back(value: Any) -> None:
    """All that the parameter server can hold."""
    server = Parameters()
    assert parameters.set_param(server, "/gains", json.dumps(value)) == {}
    found = parameters.get_param(server, "/gains", "")
    assert found.keys() == {"value"} and json.loads(found["value"]) == value
    assert parameters.has_param(server, "/gains") == {"exists": True}
    assert parameters.delete_param(server, "/gains") == {} == server.values
    assert parameters.has_param(server, "/gains") == {"exists": False}
    assert parameters.delete_param(server, "/gains") == {}


@pytest.mark.parametrize(
    ("default", "value"),
    [
        ("", None),
        ("5", 5),
        ('"five"', "five"),
        ("five", "five"),
        pytest.param(DEEP, DEEP, id="deep"),
    ],
)
def test_missing_parameter_is_its_default_or_null(default: str, value: Any) -> None:
    """The default may be JSON or any text, also one that is nested too deep to be read."""
    assert json.loads(parameters.get_param(Parameters(), "/none", default)["value"]) == value


def test_what_json_has_not_is_told_as_text() -> None:
    """Other nodes may set bytes and dates."""
    bytes_, date = xmlrpc.client.Binary(b"\x00\xff"), xmlrpc.client.DateTime("20240102T03:04:05")
    server = Parameters({"/b": bytes_, "/d": date})
    assert parameters.get_param(server, "/b", "")["value"] == '"AP8="'
    assert parameters.get_param(server, "/d", "")["value"] == '"20240102T03:04:05"'


def test_names_and_search_have_rosapis_fields() -> None:
    """Names are sorted; a name that is nowhere is empty."""
    server = Parameters({"/b": 1, "/a": 2})
    assert parameters.get_param_names(server) == {"names": ["/a", "/b"]}
    assert parameters.search_param(server, "a") == {"global_name": "/a"}
    assert parameters.search_param(server, "c") == {"global_name": ""}


@pytest.mark.parametrize(
    ("name", "value", "text"),
    [
        ("/a", "five", "value = 'five' is no JSON .* write a text as"),
        ("/a", "", "value = '' is no JSON"),
        ("/a", "null", "value = 'null': cannot marshal None"),
        ("/a", "x" * 99, f"value = '{'x' * 60}' is no JSON"),
        pytest.param("/a", DEEP, "is no JSON .maximum recursion depth", id="deep"),
        ("/a", NOTHING, re.escape(f"value = {NOTHING[:60]!r}: cannot marshal None")),
        ("/", "{}", "name = '/': allowed: the name of one parameter"),
        ("//", "{}", "name = '//': allowed"),
        (" /// ", "{}", "name = ' /// ': allowed"),
        ("", "{}", "name = '': allowed"),
    ],
)
def test_what_cannot_be_set_is_refused(name: str, value: str, text: str) -> None:
    """Nothing is changed, above all not the whole tree."""
    server = Parameters({"/a": 1})
    with pytest.raises(RequestError, match=text):
        parameters.set_param(server, name, value)
    assert server.values == {"/a": 1}


@pytest.mark.parametrize("name", ["/", "//", ""])
def test_whole_tree_cannot_be_deleted(name: str) -> None:
    """It belongs to all nodes."""
    with pytest.raises(RequestError, match="allowed: the name of one parameter"):
        parameters.delete_param(Parameters(), name)
