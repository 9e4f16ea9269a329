"""The picture of the cell as a browser with WebGL draws it."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from harness.page.theatre import Theatre, open_theatre

# Opacity of each zone, and whether it hides what is behind it; none while it is not drawn yet.
ZONES = """() => {
    const { scene } = window.panel;
    const zones = [...scene.view.objects].filter(([, { mesh }]) => /^zone /.test(mesh?.name));
    return zones.every(([id]) => scene.finished.has(id)) && zones.map(([, { mesh }]) => [
        mesh.material.transparent ? mesh.material.opacity : 1, mesh.material.depthWrite]);
}"""


@pytest.fixture(scope="module")
def drawn(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Theatre]:
    """Give a page whose browser draws the model."""
    with open_theatre(tmp_path_factory.mktemp("drawn"), draws=True) as made:
        yield made


@pytest.mark.parametrize("colours", ["dark", "light"])
def test_what_stands_in_a_zone_is_seen_through_it(drawn: Theatre, colours: str) -> None:
    """The table stands in a zone: it would be a red box."""
    drawn.resize("low")
    drawn.page.emulate_media(color_scheme=colours)  # type: ignore[arg-type]
    drawn.page.reload()
    drawn.page.wait_for_function(f"() => window.panel && ({ZONES})()?.length")
    zones = drawn.page.evaluate(ZONES)
    assert all(0.0 < opacity < 0.3 and not hides for opacity, hides in zones), zones
