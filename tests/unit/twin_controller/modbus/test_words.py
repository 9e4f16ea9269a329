"""Numbers as words: the nearest one that the register can hold."""

from __future__ import annotations

import pytest
from scara_config.modbus_map import Register
from twin_controller.modbus.words import numbers, to_words
from twin_controller.robot_sample import SetpointError

LARGEST = {"int16": 2**15 - 1, "int32": 2**31 - 1}


def register(kind: str, scale: float) -> Register:
    """Return a register of one value."""
    return Register(1, kind, "mm", "a length", scale=scale)  # type: ignore[arg-type]


@pytest.mark.parametrize("low_first", [True, False])
@pytest.mark.parametrize("kind", ["int16", "int32"])
@pytest.mark.parametrize(
    ("value", "counts"), [(12.34, 123), (12.36, 124), (-12.34, -123), (-12.36, -124), (0.0, 0)]
)
def test_a_value_between_two_counts_is_written_as_the_nearer_one(
    kind: str, value: float, counts: int, low_first: bool
) -> None:
    """Never cut: that would be off by up to a whole count, always towards 0."""
    tenths = register(kind, 0.1)
    words = to_words("it", tenths, value, low_first)
    assert numbers(tenths, words, low_first) == pytest.approx([0.1 * counts])


@pytest.mark.parametrize("kind", ["int16", "int32"])
def test_the_largest_and_the_smallest_number_fit_and_the_next_ones_do_not(kind: str) -> None:
    """What does not fit is refused, never wrapped."""
    whole, most = register(kind, 1.0), LARGEST[kind]
    for value in (most, -most - 1):
        assert numbers(whole, to_words("it", whole, value, True), True) == [value]
    for value in (most + 1, -most - 2):
        with pytest.raises(SetpointError) as refused:
            to_words("it", whole, value, True)
        assert str(refused.value) == f"it = {value} is outside [{-most - 1:g}, {most:g}]"
