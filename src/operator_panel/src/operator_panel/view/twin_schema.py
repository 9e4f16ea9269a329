"""What ``/api/twin`` answers, as JSON schema and as OpenAPI."""

from __future__ import annotations

from typing import Any

import msgspec
from scara_ros.shadow import Shadow

ROOT, JSON, EVENTS = "/api/twin", "application/json", "text/event-stream"
ROUTES: dict[str, tuple[str, str, str, dict[str, float]]] = {
    "": ("Now (0), so long ago (negative) or at a ROS time [s]", JSON, "Shadow", {"time": 0.0}),
    "/history": ("Oldest first [s]", JSON, "History", {"seconds": 10.0, "step": 0.5}),
    "/stream": ("Ten times a second, as server-sent events", EVENTS, "Shadow", {}),
}
"""What each route gives, in which form, its schema, its parameters with their default values."""
REFUSALS = {"400": "A parameter is wrong.", "404": "Not remembered.", "503": "Nobody answers."}


def json_schema() -> dict[str, Any]:
    """Return the JSON schema of the document (draft 2020-12)."""
    schema = msgspec.json.schema(Shadow)
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema}


def openapi() -> dict[str, Any]:
    """Return the OpenAPI 3.1 description of all routes."""
    place = "#/components/schemas/{name}"
    _, schemas = msgspec.json.schema_components([Shadow], ref_template=place)
    pairs = {"type": "array", "items": {"$ref": place.format(name="Shadow")}}
    schemas |= {
        "History": _object("History", "The pair at several times, oldest first.", pairs=pairs),
        "Refusal": _object("Refusal", "Why there is no answer.", error={"type": "string"}),
    }

    def answer(text: str, kind: str, name: str) -> dict[str, Any]:
        schema = {"schema": {"$ref": place.format(name=name)}}
        return {"description": text, "content": {kind: schema}}

    refusals = {status: answer(text, JSON, "Refusal") for status, text in REFUSALS.items()}
    paths = {}
    for path, (text, kind, name, defaults) in ROUTES.items():
        numbers = [
            {"name": key, "in": "query", "schema": {"type": "number", "default": value}}
            for key, value in defaults.items()
        ]
        responses = {"200": answer(text, kind, name), **refusals}
        get = {"summary": text, "parameters": numbers, "responses": responses}
        bare = {status: {"description": each["description"]} for status, each in responses.items()}
        paths[ROOT + path] = {"get": get, "head": {**get, "responses": bare}}
    info = {"title": "The pair of robots, read only", "version": "1"}
    return {"openapi": "3.1.0", "info": info, "paths": paths, "components": {"schemas": schemas}}


def _object(title: str, text: str, **fields: Any) -> dict[str, Any]:
    """Return the schema of an object whose fields are all there."""
    return {
        **{"title": title, "description": text, "type": "object"},
        **{"properties": fields, "required": list(fields)},
    }
