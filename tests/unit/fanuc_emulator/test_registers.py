"""The emulator's codec against words written by hand."""

import math

import msgspec
import pytest
from fanuc_emulator.registers import RegisterError, decode, encode
from fanuc_emulator.snpx.variables import ValueKind
from fanuc_emulator.snpx.words import encode as assigned_words
from hypothesis import given
from hypothesis import strategies as st
from scara_config.modbus_map import Register


def register(kind: str, count: int = 1) -> Register:
    """Return a register of one kind."""
    return Register(11001, kind, "", "", count)  # type: ignore[arg-type]


TABLE = [
    ("float32", (1.0,), [0x0000, 0x3F80]),
    ("float32", (-160.0,), [0x0000, 0xC320]),
    ("float32", (0.1,), [0xCCCD, 0x3DCC]),
    ("int32", (1,), [0x0001, 0x0000]),
    ("int32", (305419896,), [0x5678, 0x1234]),
    ("int32", (-2,), [0xFFFE, 0xFFFF]),
    ("int16", (-1,), [0xFFFF]),
    ("int16", (258,), [0x0102]),
    ("string", "ABC", [0x4142, 0x4300]),
]


@pytest.mark.parametrize(("kind", "value", "words"), TABLE)
def test_values_stand_low_word_first_and_text_two_characters_a_word(
    kind: str, value: object, words: list[int]
) -> None:
    """Low word first, each word big-endian on the wire, two characters a word."""
    here = register(kind, 2 if kind == "string" else 1)
    assert encode(here, value) == words  # type: ignore[arg-type]
    decoded = decode(here, words)
    assert decoded == (value if isinstance(value, str) else pytest.approx(value, rel=1e-7))


@pytest.mark.parametrize(
    ("kind", "value", "words"),
    [("int16", 3.5, [7]), ("int32", -1.7, [0xFFFD, 0xFFFF]), ("float32", 0.5, [0, 0x3F80])],
)
def test_a_scaled_value_is_a_number_of_its_steps(kind: str, value: float, words: list[int]) -> None:
    """Whole ones, the nearest, where the register is whole."""
    here = msgspec.structs.replace(register(kind), scale=0.5)
    assert encode(here, (value,)) == words
    assert decode(here, words) == (pytest.approx(value, abs=0.25 * (kind != "float32")),)
    assert decode(here, encode(here, (1.5,))) == (1.5,)


@pytest.mark.parametrize(
    ("value", "multiply", "count"),
    [
        *[(2.6, 1.0, 3), (-2.6, 1.0, -3), (2.4, -1.0, 2), (0.126, 100.0, 13), (-0.126, 100.0, -13)],
        *[(3e9, 1.0, 2**31 - 1), (-3e9, 1.0, -(2**31))],
    ],
)
def test_an_assigned_number_is_the_nearest_count_or_the_largest(
    value: float, multiply: float, count: int
) -> None:
    """By $SNPX_ASG; never cut towards 0, and never wrapped."""
    words = assigned_words(ValueKind.NUMBER, 2, multiply, value)
    assert words == encode(register("int32"), (count,))


def test_high_word_first_swaps_the_words_of_wide_values_only() -> None:
    """The map's word_order is obeyed."""
    assert encode(register("float32", 2), (1.0, 2.0), low_first=False) == [0x3F80, 0, 0x4000, 0]
    assert decode(register("int32"), [0x1234, 0x5678], low_first=False) == (305419896,)
    assert encode(register("int16", 2), (1, 2), low_first=False) == [1, 2]


@given(st.lists(st.floats(width=32), min_size=1, max_size=9))
def test_floats_survive_the_round_trip(values: list[float]) -> None:
    """Every float32, infinite and NaN too, comes back as itself."""
    here = register("float32", len(values))
    for value, back in zip(values, decode(here, encode(here, values))):
        assert back == value or (math.isnan(value) and math.isnan(back))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("kind", "value", "text"),
    [
        ("int16", (40000,), "do not fit int16"),
        ("int32", (2**31,), "do not fit int32"),
        ("float32", (1e39,), "do not fit float32"),
        ("int16", (1, 2), "holds 1 numbers"),
        ("int16", "x", "holds 1 numbers"),
        ("string", (1,), "holds a text"),
    ],
)
def test_what_does_not_fit_is_refused(kind: str, value: object, text: str) -> None:
    """No value is cut or wrapped silently."""
    with pytest.raises(RegisterError, match=text):
        encode(register(kind), value)  # type: ignore[arg-type]


def test_a_long_text_is_cut_and_a_wrong_number_of_words_refused() -> None:
    """Text fields have a fixed size; decoding needs all words."""
    assert decode(register("string", 2), encode(register("string", 2), "ABCDEF")) == "ABCD"
    with pytest.raises(RegisterError, match="2 words, not 1"):
        decode(register("float32"), [0])
