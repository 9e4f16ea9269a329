"""What is wrong with an address."""

from __future__ import annotations


class NoRegisterError(LookupError):
    """There is no such register, or it may not be written; the text says why.

    Args:
        address: Counted from 1; None: the text names what was addressed.
        why: What is there instead.
    """

    def __init__(self, address: int | None, why: str) -> None:
        super().__init__(why if address is None else f"register {address}: {why}")
