"""Two cells at one master stay apart in every spelling of their namespace."""

from __future__ import annotations

import pytest
import rosgraph
from hypothesis import given
from hypothesis import strategies as st
from scara_ros.names import (
    NamespaceError,
    current_line,
    folder_of,
    frame_in,
    is_of_cell,
    namespace_of,
    resolve,
)

SPELLINGS = ("cell_2", "/cell_2", "cell_2/", "/cell_2/", " cell_2 ", "//cell_2")
words = st.from_regex(r"[A-Za-z][A-Za-z0-9_]{0,8}", fullmatch=True)
namespaces = st.lists(words, max_size=3).map("/".join)


@pytest.mark.parametrize("spelling", SPELLINGS)
def test_every_spelling_is_the_same_cell(spelling: str) -> None:
    """Nodes, topics, frames, folders and senders."""
    assert namespace_of(spelling) == "/cell_2"
    assert resolve("move_to", spelling) == "/cell_2/move_to"
    assert frame_in("base_link", spelling) == "cell_2/base_link"
    assert folder_of("now", spelling) == "now_cell_2"
    assert is_of_cell("/cell_2/gateway", spelling)
    assert not is_of_cell("/cell_21/gateway", spelling)


@pytest.mark.parametrize("spelling", ["cell_2", "/cell_2", "/cell_2/", "", "/", "hall/cell_2"])
def test_ros_takes_a_spelling_for_the_same_namespace(spelling: str) -> None:
    """Ours is compared with the names that nodes register: rosgraph makes those."""
    namespace = rosgraph.names.get_ros_namespace(env={"ROS_NAMESPACE": spelling}, argv=[])
    assert namespace_of(namespace) == namespace_of(spelling)
    resolved = rosgraph.names.resolve_name("move_to", f"{namespace}node")
    assert resolved == resolve("move_to", spelling)


@given(namespaces, words)
def test_a_name_is_resolved_once(namespace: str, name: str) -> None:
    """An absolute name stays as it is."""
    assert resolve(resolve(name, namespace), namespace) == resolve(name, namespace)
    assert namespace_of(namespace_of(namespace)) == namespace_of(namespace)


@given(namespaces, namespaces, words)
def test_a_node_belongs_to_its_own_cell(one: str, other: str, node: str) -> None:
    """To another one only if that is around it, and never to the cell without a namespace."""
    full = resolve(node, one)
    assert is_of_cell(full, one)
    around = namespace_of(one) + "/"
    if one and not around.startswith(namespace_of(other).rstrip("/") + "/"):
        assert not is_of_cell(full, other)
    if one:
        assert not is_of_cell(full, "/")


def test_a_sender_that_is_not_known_counts_as_ours() -> None:
    """A message without a connection comes from this very process."""
    assert is_of_cell("", "/") and is_of_cell("", "/cell_2")


@pytest.mark.parametrize("text", ["cell-2", "2_cells", "cell 2", "cell_2//a", "zelle_ä", "~cell"])
def test_what_is_no_namespace_is_refused(text: str) -> None:
    """With the value and what is allowed."""
    with pytest.raises(NamespaceError, match=r"ROS_NAMESPACE = .*letters, digits and _"):
        namespace_of(text)


@pytest.mark.parametrize(
    ("said", "found"),
    [
        ("ARTICLE line 5 running", ("ARTICLE", 5)),
        ("ARTICLE line 12 paused", ("ARTICLE", 12)),
        ("ARTICLE line 5 aborted", ("", 0)),
        ("", ("", 0)),
        ("no program", ("", 0)),
    ],
)
def test_current_line_is_that_of_a_program_that_is_not_over(
    said: str, found: tuple[str, int]
) -> None:
    """A program that was ended is in no line."""
    assert current_line(said) == found
