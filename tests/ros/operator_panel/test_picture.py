"""The picture of the cell as a browser with WebGL draws it."""

from __future__ import annotations

import re
from collections.abc import Iterator

import pytest
from harness.page.acts import GHOST, preview_of, take_control
from harness.page.hand import Hand
from harness.page.theatre import Theatre, kept_theatre
from harness.running.thorough import thorough
from playwright.sync_api import expect

# Opacity of each zone, and whether it hides what is behind it; none while it is not drawn yet.
ZONES = """() => {
    const { scene } = window.panel;
    const zones = [...scene.view.objects].filter(([, { mesh }]) => /^zone /.test(mesh?.name));
    return zones.every(([id]) => scene.finished.has(id)) && zones.map(([, { mesh }]) => [
        mesh.material.transparent ? mesh.material.opacity : 1, mesh.material.depthWrite]);
}"""


# Where people stand in the picture, and how much of them is seen through.
PEOPLE = """() => window.panel.scene.view.scene.children.filter(({ name }) => name === "person")
    .map(({ position, children, material }) =>
        [position.x, position.y, children[0].position.z, material.opacity])"""


@pytest.fixture(scope="module")
def drawn() -> Iterator[Theatre]:
    """Give a page whose browser draws the model."""
    with kept_theatre(draws=True) as made:
        yield made


PLACED = "['real', 'twin'].every((side) => window.panel.scene.poses[side])"
"""Whether all groups of both are there."""

# Tools in the picture that something lies over, or that are outside of it.
HIDDEN = """() => {
    const { scene } = window.panel;
    const box = document.querySelector(".scene canvas").getBoundingClientRect();
    const hidden = [];
    for (const [side, joints] of Object.entries(scene.told.joints)) {
        if (side === "preview" && !scene.mesh(joints.root.id).visible) continue;
        const tip = scene.mesh(joints.joint_3.id);
        tip.updateWorldMatrix(true, false);
        const at = tip.position.clone().setFromMatrixPosition(tip.matrixWorld);
        at.project(scene.view.camera);
        const x = box.left + (at.x + 1) / 2 * box.width, y = box.top + (1 - at.y) / 2 * box.height;
        const found = document.elementFromPoint(x, y);
        if (!found?.closest(".scene")) hidden.push(`${side} at ${x.toFixed(0)}, ${y.toFixed(0)}`);
    }
    return hidden;
}"""


@pytest.mark.parametrize("size", ["phone", *thorough("low")])
def test_both_tools_and_the_ghost_are_in_sight(drawn: Theatre, size: str) -> None:
    """At rest, at the far end of a motion, and in a preview; nothing lies over them."""
    page = drawn.page
    drawn.resize(size)
    for scene in ("held", "ready"):
        drawn.play(scene)
        page.wait_for_function(f"() => window.panel && ({ZONES})()?.length && {PLACED}")
        drawn.settle()
        assert page.evaluate(HIDDEN) == [], scene
    drawn.open("Target")
    page.get_by_role("button", name="Preview Home").click()
    preview_of(page, "Home: OK")
    page.wait_for_function(f"() => Math.abs(({GHOST})() - 0.5) < 1e-3")
    drawn.settle()
    assert page.evaluate(HIDDEN) == [], "preview"
    page.locator("[data-motion-close]").click()


VIEWS = ("Top", "Front", "Side", "Whole")
EYE = "() => window.panel.scene.view.camera.position.toArray().map((v) => v.toFixed(3)).join()"


def test_each_view_moves_the_eye(drawn: Theatre) -> None:
    """All controls of the picture: four views, and one that follows the tool."""
    drawn.resize("wide")
    drawn.play("ready")
    page, hand = drawn.page, Hand(drawn)
    page.wait_for_function("() => window.panel?.scene.view?.camera")
    shown = page.locator(".views").get_by_role("button").locator("visible=true")
    assert sorted(shown.all_inner_texts()) == sorted((*VIEWS, "Follow", "Guide"))
    for view in VIEWS:
        before = page.evaluate(EYE)
        hand.button(view).click()
        page.wait_for_function(f"() => ({EYE})() !== {before!r}")
    hand.switch(page.locator("[data-follow]"))


def test_guide_that_turns_grey_is_let_go(drawn: Theatre) -> None:
    """Nobody can press a grey button again, and no pointer would turn the picture meanwhile."""
    drawn.resize("low")
    drawn.play("ready")
    take_control(drawn.page)
    guide, turns = drawn.page.locator("[data-guide]"), "() => panel.scene.view.controls.enabled"
    Hand(drawn).switch(guide)
    guide.click()
    drawn.page.wait_for_function(f"() => !({turns})()")
    drawn.play("following")
    expect(guide).to_be_disabled()
    expect(guide).to_have_attribute("aria-pressed", "false")
    assert drawn.page.evaluate(turns)
    drawn.play("ready")
    expect(guide).to_be_enabled()
    expect(guide).to_have_attribute("aria-pressed", "false")


@pytest.mark.parametrize("colours", ["dark", *thorough("light")])
def test_what_stands_in_a_zone_is_seen_through_it(drawn: Theatre, colours: str) -> None:
    """The table stands in a zone: it would be a red box."""
    drawn.resize("low")
    drawn.page.emulate_media(color_scheme=colours)  # type: ignore[arg-type]
    drawn.page.reload()
    drawn.page.wait_for_function(f"() => window.panel && ({ZONES})()?.length")
    zones = drawn.page.evaluate(ZONES)
    assert all(0.0 < opacity < 0.3 and not hides for opacity, hides in zones), zones


def test_people_that_sensors_see_are_in_the_picture(drawn: Theatre) -> None:
    """A body beside the robot while somebody is seen, and none afterwards."""
    drawn.resize("low")
    drawn.play("stopped")
    drawn.page.wait_for_function(f"() => window.panel && ({PEOPLE})().length === 1")
    ((x, y, z, opacity),) = drawn.page.evaluate(PEOPLE)
    assert (x, y, z) == (0.75, 0.35, 0.2) and 0.0 < opacity < 0.5
    drawn.play("ready")
    drawn.page.wait_for_function(f"() => ({PEOPLE})().length === 0")


def test_ghost_makes_the_judged_motion_and_goes_where_the_slider_is(drawn: Theatre) -> None:
    """HOME of the stage: all joints from 0 to 0.5 rad in 1.2 s; at the end it stands there."""
    page = drawn.page
    drawn.resize("low")
    drawn.play("ready")
    drawn.open("Target")
    page.wait_for_function(f"() => window.panel && ({GHOST})() === null")
    page.get_by_role("button", name="Preview Home").click()
    preview_of(page, "Home: OK: takes 1.20 s, nearest 62 mm between link_2 and")
    page.wait_for_function(f"() => Math.abs(({GHOST})() - 0.5) < 1e-3")
    expect(page.locator("[data-motion-at]")).to_have_text("1.20 of 1.20 s")
    expect(page.locator("[data-motion-play]")).to_have_text("Play")
    page.locator("[data-motion-range]").fill("0.6")
    expect(page.locator("[data-motion-now=clearance]")).to_have_text("65 mm")
    expect(page.locator("[data-motion-now=speed]")).to_have_text("1000 mm/s")
    page.wait_for_function(f"() => Math.abs(({GHOST})() - 0.25) < 1e-3")
    page.locator("[data-motion-close]").click()
    page.wait_for_function(f"() => ({GHOST})() === null")


FRAMES_DRAWN = """() => [...window.panel?.scene.view?.objects?.values() ?? []]
    .map(({ mesh }) => mesh?.name).filter((name) => /^user frame /.test(name)).join()"""


def test_a_frame_that_was_taught_meanwhile_is_drawn_and_offered_on_the_open_page(
    drawn: Theatre,
) -> None:
    """In the picture, for a target, to jog along, and for a program's positions; so is its end."""
    page = drawn.page
    drawn.resize("low")
    drawn.play("ready")
    file = drawn.runs.parent / "config" / "robots" / "fanuc_sr6ia" / "frames.yaml"
    before = file.read_text(encoding="utf-8")
    taught = "  uframe_3: {name: box, xyz_mm: [300.0, 0.0, 0.0], wpr_deg: [0.0, 0.0, 90.0]}\n"
    listed = page.locator(".frame-list")
    page.wait_for_function(f"() => ({FRAMES_DRAWN})() === 'user frame 1,user frame 2'")
    drawn.open("Robot")
    page.get_by_text("User and tool frames").click()
    for text, frames in ((before.replace("tool:\n", f"{taught}tool:\n"), "123"), (before, "12")):
        file.write_text(text, encoding="utf-8")
        drawn.open("Robot")
        page.get_by_role("button", name="Read the robot's").click()
        expect(listed).to_contain_text("user 1, pallet")
        drawn_now = ",".join(f"user frame {number}" for number in frames)
        page.wait_for_function(f"() => ({FRAMES_DRAWN})() === '{drawn_now}'")
        there = "3" in frames
        assert ("user 3, box" in listed.inner_text()) == there
        for tab, label, name in (("Target", "Frame", "3 box"), ("Teach", "Positions", "3 box")):
            drawn.open(tab)
            page.locator(".shown").get_by_label(label, exact=True).click()
            expect(page.get_by_role("option", name=name)).to_have_count(int(there))
            page.keyboard.press("Escape")
        drawn.open("Jog")
        for way, key in (("Hold tool", "hold_tool"), ("Step tool", "steps")):
            drawn.open(way)
            panel = page.locator(f"[data-way-panel={key}]")
            tab = panel.get_by_role("tab", name="3 box")
            expect(tab).to_have_count(int(there))
            if there and way == "Hold tool":
                tab.click()
            chosen = panel.locator("[data-frame][aria-selected=true]")
            expect(chosen).to_have_text("3 box" if there else "World")


# Where a point of the cell [m] is on the screen.
SEEN_AT = """([x, y, z]) => {
    const { view } = window.panel.scene;
    const box = view.renderer.domElement.getBoundingClientRect();
    const at = view.camera.position.clone().set(x, y, z).project(view.camera);
    return [box.left + (at.x + 1) / 2 * box.width, box.top + (1 - at.y) / 2 * box.height];
}"""


def drag(theatre: Theatre, *points_m: tuple[float, float, float]) -> None:
    """Press at the first point of the picture, go to the others, and let go."""
    mouse = theatre.page.mouse
    for k, point in enumerate(points_m):
        mouse.move(*theatre.page.evaluate(SEEN_AT, point))
        if k == 0:
            mouse.down()
    mouse.up()


def test_place_is_dragged_in_the_picture_and_refused_outside_the_reach(drawn: Theatre) -> None:
    """At the tool's height, above a part where one is met; the eye stays where it is."""
    page = drawn.page
    drawn.resize("wide")
    drawn.play("ready")
    page.wait_for_function(f"() => window.panel && ({ZONES})()?.length && window.panel.scene.tool")
    drawn.open("Teach")
    panel = page.locator('[data-panel="Teach"]')
    places, said = panel.get_by_label("Places", exact=True), panel.locator(".teach-said")
    panel.get_by_role("button", name="Clear", exact=True).click()
    panel.get_by_role("button", name="In picture", exact=True).click()
    eye, (*_, height) = page.evaluate(EYE), page.evaluate("() => window.panel.scene.tool")
    drag(drawn, (0.3, 0.1, height), (0.45, -0.2, height))
    expect(said).to_contain_text("is within reach")
    x, y, z = map(float, places.input_value().split())
    assert abs(x - 450.0) < 5.0 and abs(y + 200.0) < 5.0 and abs(z - 1e3 * height) < 0.01
    assert page.evaluate(EYE) == eye
    page.wait_for_function(f"() => ({GHOST})() !== null")
    page.evaluate(
        """() => window.panel.scene.showParts({ twin: [
            ["part_1", [0.5, 0.1, -0.02], [0, 0, 0, 1], 0.024, 0.02, "#888888"]] })"""
    )
    page.wait_for_function("() => window.panel.scene.parts.size === 1")
    drag(drawn, (0.3, 0.1, height), (0.502, 0.101, -0.01))
    expect(places).to_have_value(re.compile(r"\n500 100 -9.5$"))
    page.locator("[data-look-back]").click()
    drag(drawn, (0.45, -0.2, height))  # in a picture of the past it is no place
    page.locator("[data-look-back]").click()
    drag(drawn, (0.3, 0.1, -0.0095), (0.69, -0.2, -0.0095))
    expect(said).to_contain_text("In picture: there (")
    expect(places).to_have_value(re.compile(r"\n500 100 -9.5$"))
    page.keyboard.press("Escape")
    expect(panel.get_by_role("button", name="In picture")).to_have_attribute(
        "aria-pressed", "false"
    )
