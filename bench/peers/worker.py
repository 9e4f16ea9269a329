"""The peer's end of :mod:`bench.peers.process`: makes a job, then answers until its input ends."""

from __future__ import annotations

import importlib
import json
import os
import sys
import traceback
from typing import Any


def main() -> None:
    """Serve; what libraries print goes to standard error."""
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    job: Any = None
    for line in sys.stdin:
        question = json.loads(line)
        try:
            if "job" in question:
                module, name = question["job"].split(":")
                job = getattr(importlib.import_module(f"bench.peers.{module}"), name)(
                    **question["arguments"]
                )
                answer: dict[str, Any] = {"answer": getattr(job, "version", "")}
            else:
                answer = {"answer": getattr(job, question["ask"])(**question["arguments"])}
        except ImportError as error:
            answer = {"missing": str(error)}
        except Exception as error:
            traceback.print_exc()
            answer = {"error": f"{type(error).__name__}: {error}"}
        answers.write(json.dumps(answer) + "\n")
        answers.flush()


if __name__ == "__main__":
    main()
