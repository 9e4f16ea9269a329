"""The desk's page in a browser: STOP, a lost cell, alarms, figures at four sizes."""

from __future__ import annotations

import signal
import time
from pathlib import Path

from farm.desk.history_io import History, Kept
from farm.keys import CellName
from farm.wire import Event
from harness.processes import wait_until
from harness.wires.browser import kept_chromium
from playwright.sync_api import Locator
from ros.farm.conftest import DEADLINE_S, Farm

TITLES = """() => Object.fromEntries([...document.querySelectorAll(".cell")].map((card) => [
    card.querySelector("h3").textContent, card.querySelector(".cell-title").textContent]))"""


def background(place: Locator) -> str:
    """Return the colour of a button."""
    colour: str = place.evaluate("(button) => getComputedStyle(button).backgroundColor")
    return colour


def worn(data: Path) -> None:
    """Write cycles of eight days of six cells of another site; one robot lags more at the end.

    They are so old that key figures of a day no longer know of them. At one cell a learner has had
    an exercise marked three times, of which one result was told twice, and another one once.
    """
    told = []
    for number, (ago, k) in enumerate((ago, k) for ago in range(20, 12, -1) for k in range(6)):
        grown = 1.5 if ago <= 14 and k == 4 else 1.0
        lag = (0.1 + 0.002 * k) * (1.0 + 0.005 * (ago % 3)) * grown
        end = time.time() - 86400.0 * ago
        body = {"start": end - 9.0, "end": end, "outcome": "done", "program": "MILK"}
        body |= {"leader": "real", "follower_lag_s": lag}
        cycle = Event(number, end, "cycle", False, "", body)
        told.append(Kept(CellName("other", "m", f"cell_{k}"), 0, cycle))
    for number, (exercise, passed) in enumerate(((1, 0), (1, 1), (1, 1), (1, 0), (12, 0)), 100):
        body = {"learner": "<b>ada", "exercise": f"e{exercise:02d}_x", "title": f"{exercise}. X"}
        body |= {"passed": bool(passed), "marked": 1e9, "signature": f"{exercise} {passed}"}
        # The fourth is another result than the first, at another time.
        body |= {"marked": 1e9 + 60.0, "signature": "later"} if number == 103 else {}
        result = Event(number, time.time() - 86400.0 * 10, "exercise", False, "", body)
        told.append(Kept(CellName("other", "m", "cell_0"), 0, result))
    with History(data / "events", 4, 16.0) as history:
        history.write(told)


def test_desk_stops_one_and_all_and_marks_alarms(farm: Farm) -> None:
    """As a person does it: look, press, read each cell's answer."""
    worn(farm.folder)
    desk = farm.desk()
    with kept_chromium() as browser:
        page = browser.new_page(viewport={"width": 1600, "height": 900})
        page.goto(farm.opened)
        # No figure is known yet; the page that is loaded later has them at once.
        page.wait_for_selector("#kpi >> text=no cycle yet")
        farm.start("bench.synthetic", "--cells", "3", "--events-rate", "1")
        other = farm.start("bench.synthetic", "--cells", "1", "--first", "9")

        def titles() -> dict[str, str]:
            """Return what each card says of its cell, by the end of its name."""
            found: dict[str, str] = page.evaluate(TITLES)
            return found

        def worst() -> list[str]:
            """Return the chips, in their order."""
            return [" ".join(text.split()) for text in page.locator(".chip").all_inner_texts()]

        wait_until(lambda: len(titles()) == 4, DEADLINE_S, "four cells")
        stop = page.locator("[data-command=STOP][data-cell='practice/made_up_002']")
        plain, all_stop = background(stop), background(page.locator(".stop.all"))
        assert plain == background(page.locator(".cell .pause").first) != all_stop
        stop.hover()
        page.mouse.down()
        assert background(stop) == all_stop
        # It has acted at the press, before the finger leaves.
        page.wait_for_selector("text=/made_up_002: STOP received/")
        page.mouse.up()
        wait_until(lambda: "made_up_002 Stopped" in worst(), DEADLINE_S, "its chip")
        assert page.locator(".answer", has_text="STOP received").count() == 1
        stopped = [name for name, title in titles().items() if title == "Stopped"]
        assert stopped == ["made_up_002"]
        assert "STOP received" in page.locator(".cell-facts[data-is=good]").inner_text()
        page.locator("[data-command=PAUSE][data-cell=all]").focus()
        page.keyboard.press("Enter")
        wait_until(
            lambda: page.locator(".answer", has_text="PAUSE received").count() == 4,
            DEADLINE_S,
            "an answer of each cell",
        )
        assert page.locator(".answer", has_text="STOP received").count() == 1
        other.signal(signal.SIGKILL)
        wait_until(lambda: worst()[:1] == ["made_up_009 Lost"], DEADLINE_S, "it, the worst")
        page.locator(".chip", has_text="made_up_009").click()
        found = page.locator(".cell.is-found h3")
        assert found.inner_text() == "made_up_009"
        wait_until(lambda: page.locator(".event").count() > 0, DEADLINE_S, "events of the journals")
        lost = page.locator(".alarm", has_text="link: The cell is lost")
        wait_until(lambda: lost.count() == 1, DEADLINE_S, "the alarm of the lost cell")
        lost.get_by_role("button", name="Acknowledge").click()
        wait_until(
            lambda: lost.get_attribute("data-status") == "acknowledged", DEADLINE_S, "the look"
        )
        slow = page.locator(".alarm", has_text="real: R[5] is slow")
        wait_until(lambda: "4 × real" in slow.inner_text(), DEADLINE_S, "equal alarms as one row")
        names = [f"made_up_{k:03d}" for k in (0, 1, 2, 9)]
        assert slow.locator(".alarm-cells").inner_text() == ", ".join(names)
        slow.get_by_role("button", name="Shelve").click()
        # The page goes on while somebody writes.
        told = page.locator("#clock").inner_text()
        wait_until(lambda: page.locator("#clock").inner_text() != told, DEADLINE_S, "its clock")
        why = slow.get_by_role("textbox")
        why.fill("a spare part comes")
        why.press("Enter")
        wait_until(lambda: slow.get_attribute("data-status") == "shelved", DEADLINE_S, "the shelf")
        assert "a spare part comes" in slow.inner_text()
        assert "real: shelved by ann" in page.locator(".answer").first.inner_text()
        page.reload()
        wait_until(lambda: page.locator(".figures .all-cells").count() == 1, DEADLINE_S, "figures")
        assert page.locator("#causes li").count() >= 1
        # Packed once for all pages, not once more for each.
        for kind, packed in (("gzip", "gzip"), ("identity", None)):
            wall = page.request.get(f"{farm.address}/farm/wall", headers={"accept-encoding": kind})
            assert wall.headers.get("content-encoding") == packed and wall.json()["cards"]
        learner = page.locator("#class tbody td")
        wait_until(lambda: learner.count() == 5, DEADLINE_S, "a learner")
        assert learner.all_inner_texts()[:4] == ["<b>ada", "1", "✓ 3", "– 1"]
        assert "marked 3 times, last 2001-09-09" in str(learner.nth(2).get_attribute("title"))
        away = page.locator("#drift-picture .away")
        wait_until(lambda: away.count() == 1, DEADLINE_S, "the picture of all cells")
        assert page.locator("#drift-picture .steady").count() == 5
        assert page.locator("#drift-picture .name").text_content() == "m/cell_4"
        assert "m/cell_4: lag of the robot" in page.locator("#drifts").inner_text()
        page.get_by_label("compared with").select_option("practice/made_up_001")
        page.get_by_label("time", exact=True).select_option("12h")
        page.get_by_role("button", name="Compare").click()
        page.wait_for_selector("#compared >> text=parts placed")
        for width, height in ((1920, 1080), (1280, 800), (820, 1180), (390, 844)):
            page.set_viewport_size({"width": width, "height": height})
            wide = "document.documentElement.scrollWidth <= innerWidth"
            held = "((e) => e.scrollWidth <= e.clientWidth)(document.getElementById('kpi'))"
            assert page.evaluate(wide) and page.evaluate(held), width
            assert page.evaluate(held.replace("kpi", "class")), width
        page.set_viewport_size({"width": 1600, "height": 900})
        page.evaluate("window.scrollTo(0, 0)")
        before = page.locator(".cell").first.bounding_box()
        desk.signal(signal.SIGKILL)
        page.wait_for_selector("#banner:has-text('The desk does not answer')")
        page.locator("[data-command=STOP][data-cell='practice/made_up_000']").click()
        page.wait_for_selector("#banner:has-text('use the STOP at the cell')")
        assert page.locator(".cell").first.bounding_box() == before
