"""Controls that all pages share."""

from __future__ import annotations

import pytest
from scara_ros.page.page_library_io import tabs_of


@pytest.mark.parametrize("name", ["1 Halle\\Nord", '2 plate 6"', "3 C:\\"])
def test_a_name_that_a_person_typed_is_the_value_of_its_tab(name: str) -> None:
    """A frame may have any name; one that raises would end the panel, and the cell with it."""
    from nicegui import Client, ui

    with Client(ui.page("/tabs")):
        (tab,) = tabs_of({name: name}, "frame")
    assert tab.props["data-frame"] == name
