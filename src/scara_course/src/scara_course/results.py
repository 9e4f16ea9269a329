"""What was marked: one line of JSON each, signed, and the same as xAPI statements.

The signature is an HMAC-SHA256 over all other fields, among them the SHA-256 of what was marked. It
shows a line that was changed afterwards. Whoever has the key can sign anything: a class whose
results must hold against its learners needs them marked where the key is the teacher's.
"""

from __future__ import annotations

import hashlib
import hmac
from datetime import datetime, timezone
from typing import Any

import msgspec
from cell_recorder.journal.entries import CourseResult

HOME = "https://example.org/scara-twin"  # our choice: names learners and activities, leads nowhere
VERBS = "http://adlnet.gov/expapi/verbs/"
ASSESSMENT = "http://adlnet.gov/expapi/activities/assessment"


def encode(result: CourseResult) -> bytes:
    """Return a result as a line of the file."""
    return msgspec.json.encode(result) + b"\n"


def decode(line: bytes) -> CourseResult:
    """Return the result of a line.

    Raises:
        msgspec.DecodeError: It is none.
    """
    return msgspec.json.decode(line, type=CourseResult)


def signed(result: CourseResult, key: str) -> CourseResult:
    """Return a result with its signature."""
    # A signature cannot be part of what it signs.
    bare = encode(msgspec.structs.replace(result, signature=""))
    mark = hmac.new(key.encode(), bare, hashlib.sha256).hexdigest()
    return msgspec.structs.replace(result, signature=mark)


def is_genuine(result: CourseResult, key: str) -> bool:
    """Return whether a result is as it was signed with this key."""
    # As bytes: of texts it takes ASCII only, and a line of the file may hold any.
    marks = (signed(result, key).signature.encode(), result.signature.encode())
    return hmac.compare_digest(*marks)


def statement(result: CourseResult, identifier: str) -> dict[str, Any]:
    """Return a result as an xAPI statement.

    Args:
        result: The result.
        identifier: UUID of the statement, always the same for this result, so that a store which
            gets it twice keeps it once.

    Source:
        xAPI 1.0.3, part two, section 2: actor, verb, object, result, timestamp.
    """
    verb = "passed" if result.passed else "failed"
    return {
        "id": identifier,
        "version": "1.0.3",
        "timestamp": datetime.fromtimestamp(result.time, timezone.utc).isoformat(),
        "actor": {
            "objectType": "Agent",
            "name": result.learner,
            "account": {"homePage": HOME, "name": result.learner},
        },
        "verb": {"id": VERBS + verb, "display": {"en": verb}},
        "object": {
            "objectType": "Activity",
            "id": f"{HOME}/course/{result.exercise}",
            "definition": {"type": ASSESSMENT, "name": {"en": result.title}},
        },
        "result": {
            "success": result.passed,
            "completion": True,
            "response": result.reason,
            "extensions": {
                f"{HOME}/evidence": result.evidence,
                f"{HOME}/sha256": result.digest,
                f"{HOME}/signature": result.signature,
            },
        },
    }
