"""What is wrong with a call of rosapi."""

from __future__ import annotations


class RequestError(ValueError):
    """The arguments of a call do not fit; the text says why and goes to the client."""
