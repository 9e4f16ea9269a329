"""The one error of this package."""

from __future__ import annotations


class WhatIfError(ValueError):
    """What was asked cannot be judged at all; the text says what is wrong with the question."""
