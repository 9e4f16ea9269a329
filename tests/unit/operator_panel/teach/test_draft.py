"""A program is taught line by line: whatever is edited, the robot's reader takes it."""

from __future__ import annotations

import random
from collections.abc import Callable
from functools import partial

import msgspec
import pytest
from harness.page.scenes import ready
from harness.programs import steps_of
from harness.workspace import ROOT
from hypothesis import given
from hypothesis import strategies as st
from operator_panel.teach import draft as teach
from operator_panel.teach.draft import Draft, TeachError, draft_of, empty
from operator_panel.teach.history import MOST, Edits
from operator_panel.teach.places import position_of, real_at, stands_at, twin_target
from scara_config import Joint, Robot, load_robot
from scara_config.programs.files import joint_values, program_files, taught_of
from scara_config.programs.steps import GripperStep, MoveStep, WaitStep

ROBOT = load_robot(ROOT / "config")
HOME = {joint.name: 0.0 for joint in ROBOT.joints}
RANDOM_PROGRAMS = 200


def at(**values: float) -> dict[str, float]:
    """Return home with some joints elsewhere [deg or mm]."""
    return HOME | {name: value * ROBOT.joint(name).scale for name, value in values.items()}


def record(draft: Draft, after: int, now: dict[str, float], kind: str = "J") -> Draft:
    """Record a motion at half speed, or 100 mm/s, to FINE."""
    speed = 50.0 if kind == "J" else 100.0
    return teach.recorded(draft, ROBOT, after, position_of(ROBOT, now), kind, speed, None)


def two_points() -> Draft:
    """Return a program of a joint motion and a line."""
    draft = record(empty("MINE", ROBOT), 0, at(joint_1=30.0))
    return record(draft, 1, at(joint_1=-30.0, joint_2=40.0), "L")


def lines(draft: Draft) -> list[str]:
    """Return the lines as the robot shows them."""
    rows = draft.text.partition("/MN\n")[2].partition("/POS")[0].splitlines()
    return [row.partition(":")[2].rstrip(" ;").strip() for row in rows]


def test_taught_program_does_what_was_recorded() -> None:
    """Executed by the stand-in's own rehearsal: another way than the one that wrote it."""
    draft = two_points()
    draft = teach.waiting(draft, ROBOT, 1, 0.5)
    draft = teach.gripping(draft, ROBOT, 2, True)
    draft = teach.deleted(draft, ROBOT, 5)
    draft = teach.looped(draft, ROBOT, 1, 4, 2)
    assert lines(draft) == [
        *("FOR R[51:round]=1 TO 2", "J P[1] 50% FINE", "WAIT    .50(sec)"),
        *("RO[1:suction]=ON", "WAIT RI[1:vacuum]=ON", "ENDFOR"),
    ]
    done = steps_of(taught_of(draft.program, ROBOT, "MINE"), ROBOT)
    assert [type(step) for step in done] == [MoveStep, WaitStep, GripperStep] * 2
    move = done[0]
    assert isinstance(move, MoveStep)
    wanted = [at(joint_1=30.0)[joint.name] for joint in ROBOT.joints]
    assert move.target == pytest.approx(wanted, abs=1e-9)
    assert (move.speed_percent, move.fine) == (50.0, True)


@pytest.mark.parametrize("joint", ROBOT.joints, ids=lambda joint: joint.name)
def test_position_comes_back_within_half_a_thousandth(joint: Joint) -> None:
    """[deg or mm], over the whole range of each joint."""
    index = ROBOT.joints.index(joint)
    for share in (0.0, 0.123456789, 0.5, 0.987654321, 1.0):
        value = joint.lower + share * (joint.upper - joint.lower)
        draft = record(empty("A", ROBOT), 0, HOME | {joint.name: value})
        (position,) = draft_of(draft.text, ROBOT).program.positions
        assert abs(joint_values(position, ROBOT)[index] - value) / joint.scale <= 0.0005


def test_touched_up_position_moves_all_that_go_there() -> None:
    """The number and the name stay; so does the second line that goes to it."""
    draft = teach.noted(two_points(), ROBOT, 1, "left")
    draft = teach.touched_up(draft, ROBOT, 1, position_of(ROBOT, at(joint_1=31.5)))
    first = draft.program.positions[0]
    assert (first.number, first.comment) == (1, "left")
    assert first.groups[0].coordinates[0].value == 31.5
    assert lines(draft)[0] == "J P[1:left] 50% FINE"


def test_lines_change_places_and_speeds_and_corners() -> None:
    """The pendant's own words tell each change."""
    draft = teach.moved(two_points(), ROBOT, 1, 1)
    draft = teach.with_speed(draft, ROBOT, 1, 250.0)
    draft = teach.with_corner(draft, ROBOT, 1, 50.0)
    assert lines(draft) == ["L P[2] 250mm/sec CNT50", "J P[1] 50% FINE"]
    assert lines(teach.with_corner(draft, ROBOT, 1, None))[0] == "L P[2] 250mm/sec FINE"
    assert lines(teach.noted(draft, ROBOT, 0, "begin"))[0] == "!begin"


def test_deleted_loop_leaves_its_lines_and_deleted_motion_its_place_to_others() -> None:
    """Both words of the loop go; a position goes with the last line that needs it."""
    draft = teach.looped(two_points(), ROBOT, 1, 2, 3)
    assert lines(teach.deleted(draft, ROBOT, 4)) == lines(two_points())
    assert lines(teach.deleted(draft, ROBOT, 1)) == lines(two_points())
    assert [p.number for p in teach.deleted(two_points(), ROBOT, 1).program.positions] == [2]


REFUSED: dict[str, tuple[Callable[[Draft], Draft], str]] = {
    "joint out of range": (
        lambda d: record(d, 0, at(joint_1=1000.0)),
        r"P\[3\]\.J1 = 1000 deg: outside \[",
    ),
    "speed": (
        lambda d: teach.with_speed(d, ROBOT, 1, 101.0),
        r"line 1 of MINE: J P\[1\] 101% FINE: a speed of 101 % is outside \]0, 100\]",
    ),
    "corner": (
        lambda d: teach.with_corner(d, ROBOT, 2, 101.0),
        r"CNT of 101 is outside \[0, 100\]",
    ),
    "wait": (lambda d: teach.waiting(d, ROBOT, 0, 0.001), r"a wait of 0 s is outside"),
    "long wait": (lambda d: teach.waiting(d, ROBOT, 0, 400.0), r"a wait of 400 s is outside"),
    "above the first": (lambda d: teach.moved(d, ROBOT, 1, -1), "no line is chosen"),
    "below the last": (lambda d: teach.moved(d, ROBOT, 2, 1), "there is no line 3"),
    "first of none": (
        lambda d: teach.deleted(empty("MINE", ROBOT), ROBOT, 1),
        "there is no line 1",
    ),
    "torn loop": (
        lambda d: teach.moved(
            teach.moved(teach.looped(d, ROBOT, 1, 1, 2), ROBOT, 1, 1), ROBOT, 2, 1
        ),
        "nothing that it ends has begun",
    ),
    "half a loop": (
        lambda d: teach.looped(teach.looped(d, ROBOT, 1, 1, 2), ROBOT, 3, 4, 2),
        "lines 3 to 4 hold half of a block",
    ),
    "rounds": (lambda d: teach.looped(d, ROBOT, 1, 1, 0), "0 rounds are outside"),
    "no motion": (
        lambda d: teach.with_speed(teach.waiting(d, ROBOT, 0, 1.0), ROBOT, 1, 5.0),
        "line 1 is no motion",
    ),
    "remark": (
        lambda d: teach.noted(teach.waiting(d, ROBOT, 0, 1.0), ROBOT, 0, "a;b"),
        "a semicolon ends the line",
    ),
    "remark without words": (lambda d: teach.noted(d, ROBOT, 0, " "), "a remark has words"),
    "name of a position": (lambda d: teach.noted(d, ROBOT, 1, "a]b"), "MINE"),
    "name": (lambda d: teach.renamed(d, ROBOT, "mine 2"), "capitals, digits and underlines"),
    "no program": (lambda d: draft_of("nothing", ROBOT), "is no program of a teach pendant"),
    "no position": (
        lambda d: draft_of(d.text.replace("P[2]{", "P[7]{"), ROBOT),
        r"P\[2\] is not taught, there are P\[1\], P\[7\]",
    ),
    "register": (
        lambda d: teach.touched_up(
            draft_of(d.text.replace("J P[1]", "J P[R[1]]"), ROBOT),
            ROBOT,
            1,
            position_of(ROBOT, HOME),
        ),
        "a register says where line 1 goes",
    ),
}


@pytest.mark.parametrize("what", REFUSED)
def test_edit_that_the_robot_would_not_take_is_refused_in_its_words(what: str) -> None:
    """The draft from before stays as it was."""
    draft = two_points()
    edit, why = REFUSED[what]
    with pytest.raises(TeachError, match=why):
        edit(draft)
    assert draft == two_points()


@pytest.mark.parametrize("name", program_files(ROOT / "config"))
def test_programs_of_the_robot_can_be_taught_on(name: str) -> None:
    """They come in, get a line and go out again, and nothing else of them changes."""
    text = program_files(ROOT / "config")[name].read_text(encoding="utf-8")
    draft = draft_of(text, ROBOT)
    assert draft_of(draft.text, ROBOT) == draft
    longer = teach.waiting(draft, ROBOT, len(draft.program.lines), 1.0)
    assert longer.program.lines[:-1] == draft.program.lines
    assert longer.program.positions == draft.program.positions


Edit = Callable[[Draft], Draft]


def edits(seed: random.Random, draft: Draft) -> Edit:
    """Return an edit that a person could ask for, sound or not."""
    count = len(draft.program.lines)
    line, other = seed.randint(0, count + 1), seed.randint(0, count + 1)
    now = {j.name: j.lower + seed.random() * (j.upper - j.lower) for j in ROBOT.joints}
    kind = seed.choice("JL")
    position = position_of(ROBOT, now, seed.choice(["", "over", "near 1"]))
    cnt = seed.choice([None, 0.0, round(seed.uniform(0.0, 110.0), 1)])
    speed = round(seed.uniform(-5.0, 110.0), seed.randint(0, 3))
    return seed.choice(
        [
            lambda d: teach.recorded(d, ROBOT, line, position, kind, speed, cnt),
            lambda d: teach.recorded(d, ROBOT, line, position, "L", 10.0 * speed, cnt),
            lambda d: teach.touched_up(d, ROBOT, line, position),
            lambda d: teach.moved(d, ROBOT, line, seed.choice((-1, 1))),
            lambda d: teach.deleted(d, ROBOT, line),
            lambda d: teach.with_speed(d, ROBOT, line, speed),
            lambda d: teach.with_corner(d, ROBOT, line, cnt),
            lambda d: teach.noted(d, ROBOT, line, seed.choice(["over", "a b [c]", " x;", "", "!"])),
            lambda d: teach.waiting(d, ROBOT, line, speed),
            lambda d: teach.gripping(d, ROBOT, line, seed.random() < 0.5),
            lambda d: teach.looped(d, ROBOT, line, other, seed.randint(-1, 12)),
        ]
    )


def taught_at_random(seed: random.Random, length: int) -> Draft:
    """Return what comes of so many random edits, without those that are refused."""
    draft = empty("RANDOM", ROBOT)
    for _ in range(length):
        edit = edits(seed, draft)
        try:
            draft = edit(draft)
        except TeachError:
            continue
    return draft


def test_random_programs_come_back_equal_from_their_text() -> None:
    """200 of them, of up to 40 edits; each is executed to its end where it can be."""
    longest = 0
    for number in range(RANDOM_PROGRAMS):
        draft = taught_at_random(random.Random(number), 5 + number % 36)
        longest = max(longest, len(draft.program.lines))
        again = draft_of(draft.text, ROBOT)
        assert again == draft, f"program {number}"
        assert again.text == draft.text, f"program {number}"
        taught_of(again.program, ROBOT, "RANDOM")
    assert longest > 15


@given(st.randoms(use_true_random=False), st.integers(1, 12))
def test_undo_leads_back_through_every_edit_and_redo_forward(
    seed: random.Random, length: int
) -> None:
    """To the letter, each as a version of its own; a new edit takes what could be made again."""
    history = Edits(empty("RANDOM", ROBOT))
    seen = [history.draft]
    for _ in range(length):
        try:
            made = edits(seed, history.draft)(history.draft)
        except TeachError:
            continue
        history = history.edited(made, seed.randint(-1, 99))
        seen.append(made)
    for wanted in reversed(seen[:-1]):
        before, history = history.version, history.undo()
        assert history.draft == wanted and history.version > before
    with pytest.raises(TeachError, match="nothing to undo"):
        history.undo()
    for wanted in seen[1:]:
        before, history = history.version, history.redo()
        assert history.draft == wanted and history.version > before
    with pytest.raises(TeachError, match="nothing to redo"):
        history.redo()


def test_undo_is_bounded_and_ends_what_could_be_made_again() -> None:
    """Memory does not grow with a long day of teaching."""
    history = Edits(empty("A", ROBOT))
    drafts = [teach.waiting(empty("A", ROBOT), ROBOT, 0, 0.01 * (k + 1)) for k in range(MOST + 5)]
    for draft in drafts:
        history = history.edited(draft, 1)
    assert len(history.before) == MOST
    history = history.undo().edited(drafts[0], 1)
    with pytest.raises(TeachError, match="nothing to redo"):
        history.redo()


@pytest.mark.parametrize(("chosen", "line"), [(-1, 0), (0, 0), (1, 1), (2, 2), (3, 2)])
def test_the_line_that_an_edit_leaves_chosen_is_one_of_the_draft(chosen: int, line: int) -> None:
    """Or none: an edit may have taken away the one behind it."""
    one = teach.waiting(empty("A", ROBOT), ROBOT, 0, 0.5)
    two = teach.waiting(one, ROBOT, 0, 0.5)
    assert Edits(one).edited(two, chosen).chosen == line


def test_a_position_is_kept_as_finely_as_in_the_programs_that_come_along() -> None:
    """To a millionth, and no zero has a sign."""
    position = position_of(ROBOT, at(joint_1=1.2345678, joint_2=-1e-9))
    values = [each.value for each in position.groups[0].coordinates]
    assert list(map(str, values[:2])) == ["1.234568", "0.0"]


@pytest.mark.parametrize("robot", ["articulated_six", "epson_gx4", "fanuc_sr3ia", "scara_4axis"])
def test_every_robot_can_be_taught(robot: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its own joints and its own external axes."""
    monkeypatch.setenv("SCARA_ROBOT", robot)
    other: Robot = load_robot(ROOT / "config")
    middle = {j.name: 0.5 * (j.lower + j.upper) for j in other.joints}
    add = partial(teach.recorded, robot=other, after=0, kind="J", speed=10.0, cnt=None)
    draft = add(empty("A", other), position=position_of(other, middle))
    target = twin_target(other, draft.program.positions[0])
    assert target == pytest.approx([middle[j.name] for j in other.twin_joints], abs=1e-8)


@pytest.mark.parametrize("side", ["twin_standing_still", "real_standing_still"])
def test_position_is_taken_of_a_pair_that_stands_together(side: str) -> None:
    """What the twin lacks is the real robot's; neither side may move, nor be apart."""
    snapshot = ready(ROBOT, 0.0)
    state = snapshot.state
    assert state is not None
    now = stands_at(ROBOT, snapshot)
    shown = dict(zip(state.name, state.twin_position, strict=True))
    assert now == pytest.approx(
        {joint.name: shown.get(joint.name, 12.5) * joint.scale for joint in ROBOT.joints}
    )
    for wrong, why in ((side, "while both robots stand still"), ("diverged", "are apart")):
        changed = msgspec.structs.replace(state, **{wrong: wrong == "diverged"})
        with pytest.raises(TeachError, match=why):
            stands_at(ROBOT, msgspec.structs.replace(snapshot, state=changed))


def test_no_place_is_taken_of_a_robot_that_is_not_heard() -> None:
    """Where it stood before its line was lost is not where it stands."""
    snapshot = ready(ROBOT, 0.0)
    state = snapshot.state
    assert state is not None and real_at(ROBOT, snapshot)
    lost = msgspec.structs.replace(state, mode="OFFLINE", real_position=())
    with pytest.raises(TeachError, match="joint_1 is, is not known"):
        real_at(ROBOT, msgspec.structs.replace(snapshot, state=lost))
