"""Try something on a copy of the whole process, so that what was reached can be used again.

A cell is brought somewhere once; whatever is tried from there begins with the same bits.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import Any

import msgspec


def copied(call: Callable[[], object], kind: Any = None) -> Any:
    """Make ``call`` in a copy of this process and return what it gave.

    Args:
        call: What it gives can be told in JSON.
        kind: Of what it gives.

    Raises:
        AssertionError: The copy raised it.
        RuntimeError: The copy ended otherwise; the text is its error.
    """
    reading, writing = os.pipe()
    child = os.fork()
    if not child:
        os.close(reading)
        try:
            text = b"+" + msgspec.json.encode(call())
        except AssertionError as error:
            text = b"!" + str(error).encode()
        except BaseException as error:
            text = b"-" + repr(error).encode()
        with os.fdopen(writing, "wb") as pipe:
            pipe.write(text)
        os._exit(0)
    os.close(writing)
    with os.fdopen(reading, "rb") as pipe:
        text = pipe.read()
    os.waitpid(child, 0)
    if text[:1] == b"!":
        raise AssertionError(text[1:].decode())
    if text[:1] != b"+":
        raise RuntimeError(f"a copy of the cell ended: {text[1:].decode() or 'without a word'}")
    return msgspec.json.decode(text[1:], type=kind)
