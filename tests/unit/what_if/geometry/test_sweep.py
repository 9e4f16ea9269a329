"""Nothing slips between two samples, and no clearance is promised that is not there."""

from __future__ import annotations

import os
from collections.abc import Iterator

import numpy as np
import pytest
from harness.running.thorough import examples, thorough
from harness.yaml_files import CONFIG
from scara_config.profile import CHOICE
from what_if.cell_files_io import read_cell
from what_if.geometry.bodies import Body, FloatArray, Kind, bodies_of, upright
from what_if.geometry.pairs import watched_pairs
from what_if.geometry.scene import Press, Scene
from what_if.geometry.sweep import sweep
from what_if.geometry.tree import Tree, stroke
from what_if.geometry.way import Way, straight
from what_if.world import Cell, World

from scara_description.urdf import parse_urdf

NEARER = 1e-3
ROBOTS = ("fanuc_sr6ia", "fanuc_sr3ia", "articulated_six")


@pytest.fixture(params=ROBOTS)
def cell(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Cell:
    """Each robot of the configuration."""
    monkeypatch.setitem(os.environ, CHOICE, request.param)
    return read_cell(CONFIG)


def random_poses(tree: Tree, cell: Cell, count: int, seed: int) -> FloatArray:
    """Return joint positions all over the ranges, shape (count, n)."""
    low, high = np.array([(j.lower, j.upper) for j in cell.robot.twin_joints]).T
    return np.random.default_rng(seed).uniform(low, high, (count, len(tree.joints)))


@pytest.mark.parametrize(
    ("shape", "size", "half"),
    [
        ("box", (0.2, 0.4, 0.6), (0.1, 0.2, 0.3)),
        ("cylinder", (0.02, 0.7), (0.02, 0.02, 0.35)),
        ("sphere", (0.3,), (0.3, 0.3, 0.3)),
    ],
)
def test_the_box_around_a_body_touches_it(
    shape: str, size: tuple[float, ...], half: tuple[float, ...]
) -> None:
    """A larger one would cost proofs, a smaller one would be none."""
    body = Body("it", Kind.OBSTACLE, "base_link", shape, size, np.eye(4))
    assert body.half == pytest.approx(half)
    assert body.corners.max(axis=0) == pytest.approx(half)
    assert body.corners.min(axis=0) == pytest.approx([-x for x in half])


def test_no_point_moves_further_than_the_bound(cell: Cell) -> None:
    """The corners of each body, over joint moves of any size: the proof rests on this."""
    q = random_poses(cell.tree, cell, 400, 1)
    ways = np.abs(np.diff(q, axis=0))
    poses = cell.tree.poses(q)
    for body in cell.bodies:
        at = poses[:, cell.tree.index[body.link]]
        corners = np.einsum("mij,kj->mki", at[:, :3, :3], body.corners) + at[:, None, :3, 3]
        moved = np.linalg.norm(np.diff(corners, axis=0), axis=2).max(axis=1)
        assert np.all(moved <= ways @ cell.tree.reach(body) + 1e-12), body.name


def test_the_bound_is_reached(cell: Cell) -> None:
    """A small turn of the first joint moves the tool's link by most of what the bound says."""
    body = next(b for b in cell.bodies if b.link == cell.robot.tool_frame)
    q = random_poses(cell.tree, cell, 2000, 2)
    turned = q + np.eye(len(cell.tree.joints))[0] * 1e-6
    index = cell.tree.index[body.link]
    moved = cell.tree.poses(turned)[:, index, :3, 3] - cell.tree.poses(q)[:, index, :3, 3]
    assert np.linalg.norm(moved, axis=1).max() > 0.6e-6 * cell.tree.reach(body)[0]


def post(world: World, x: float, y: float, radius: float) -> Body:
    """Return an upright post as high as the forearm."""
    root = world.cell.tree.links[0]
    return upright("post", Kind.OBSTACLE, root, "cylinder", (radius, 0.7), (x, y, 0.05))


def posts() -> Iterator[tuple[float, float]]:
    """Yield places all around the robot, each in the way of a turn of joint 1."""
    for angle in np.linspace(-2.0, 2.0, examples(13, 37)):
        for radius in (0.2, 0.45, 0.655):
            yield float(radius * np.cos(angle)), float(radius * np.sin(angle))


@pytest.mark.parametrize("radius", [1e-4, *thorough(2e-3)])
def test_a_thin_post_is_never_missed(world: World, radius: float) -> None:
    """A post of 0.2 mm that a stretched arm sweeps over in one turn, wherever it stands."""
    way = straight((-2.4, 0.0, -0.05, 0.0), (2.4, 0.0, -0.05, 0.0))
    for x, y in posts():
        scene = Scene(world.cell.tree, [*world.cell.bodies, post(world, x, y, radius)], Press())
        hit = sweep(scene, way, NEARER).hit
        assert hit is not None, (x, y)
        names = {scene.bodies[k].name for k in (scene.pairs[hit.pair].first,)}
        names.add(scene.bodies[scene.pairs[hit.pair].second].name)
        assert "post" in names


def test_the_first_of_two_posts_is_told(world: World) -> None:
    """The reason is the first in time, not the deepest."""
    near, far = post(world, 0.45, -0.3, 0.02), post(world, 0.45, 0.3, 0.05)
    scene = Scene(world.cell.tree, [*world.cell.bodies, near, far], Press())
    hit = sweep(scene, straight((-2.4, 0.0, -0.05, 0.0), (2.4, 0.0, -0.05, 0.0)), NEARER).hit
    assert hit is not None
    angle = -2.4 + 4.8 * hit.u
    assert -0.95 < angle < -0.55


def test_a_way_just_clear_of_a_post_is_no_hit(world: World) -> None:
    """An arm that passes a post 25 um above what is allowed: a doubt is no larger than that."""
    way = straight((-0.05, 0.0, -0.05, 0.0), (0.05, 0.0, -0.05, 0.0))

    def at(x: float) -> Scene:
        return Scene(world.cell.tree, [*world.cell.bodies, post(world, x, 0.0, 0.02)], Press())

    near, far = 0.6, 0.8
    while far - near > 1e-7:
        x = 0.5 * (near + far)
        near, far = (x, far) if densely(at(x), way, 301) < NEARER + 2.5e-5 else (near, x)
    assert densely(at(far), way, 301) == pytest.approx(NEARER + 2.5e-5, abs=2e-6)
    assert sweep(at(far), way, NEARER).hit is None
    assert sweep(at(far - 3e-5), way, NEARER).hit is not None


def densely(scene: Scene, way: Way, count: int) -> float:
    """Return the smallest distance of all pairs by looking everywhere."""
    u = np.linspace(0.0, way.length, count)
    scene.distances.forget()
    poses = scene.body_poses(way.at(u))
    gaps, least = scene.gaps(poses), np.inf
    for k in range(count):
        for number in np.flatnonzero((gaps[k] < least) & scene.never):
            least = min(least, scene.distance(k, poses[k], int(number)))
    return float(least)


def test_the_clearance_is_what_a_dense_look_finds(cell: Cell) -> None:
    """On ways through the whole workspace: never less than promised, and as near as told."""
    scene = Scene(cell.tree, cell.bodies, Press())
    q = random_poses(cell.tree, cell, examples(12, 24), 3)
    for start, end in zip(q[::2], q[1::2]):
        way = straight(start, end)
        found, least = sweep(scene, way, NEARER), densely(scene, way, 300)
        if found.hit is not None:
            continue
        assert found.nearest is not None
        assert least >= found.at_least
        assert found.nearest.distance <= least * 1.06 + 6e-4


def test_a_way_of_many_knots_is_that_of_its_pieces(world: World) -> None:
    """A polyline along a straight way finds what the straight way finds."""
    scene = Scene(world.cell.tree, [*world.cell.bodies, post(world, 0.45, 0.3, 0.02)], Press())
    start, end = np.array((-2.0, 0.5, -0.1, 0.0)), np.array((2.0, -0.5, -0.05, 0.0))
    knots = start + np.linspace(0.0, 1.0, 501)[:, None] * (end - start)
    one, many = sweep(scene, straight(start, end), NEARER), sweep(scene, Way(knots), NEARER)
    assert one.hit is not None and many.hit is not None
    assert many.hit.u / 500.0 == pytest.approx(one.hit.u, abs=2e-3)


def test_a_free_way_is_decided_by_few_distances(world: World) -> None:
    """Some 30; a bound that is too small asks for thousands, and a verdict would come too late."""
    scene, asked = Scene(world.cell.tree, world.cell.bodies, Press()), []
    measure = scene.distance
    scene.distance = lambda *words: asked.append(words) or measure(*words)
    assert sweep(scene, straight(world.q, (-2.0, 1.5, -0.05, 1.0)), NEARER).hit is None
    assert len(asked) < 60


def test_what_stands_still_is_looked_at_too(world: World) -> None:
    """A way of no length: an arm that touches something already is told."""
    scene = Scene(world.cell.tree, [*world.cell.bodies, post(world, 0.65, 0.0, 0.02)], Press())
    here = np.array([[0.0, 0.0, -0.16, 0.0]])
    assert sweep(scene, Way(here), NEARER).hit is not None
    free = Scene(world.cell.tree, world.cell.bodies, Press())
    assert sweep(free, Way(here), NEARER).hit is None


def beyond(world: World, way: Way, away: float) -> Scene:
    """Return a scene with a post that the end of a way is so far from [m]: a stretched arm's tip.

    The post stands in the direction in which joint 1 turns.
    """

    def at(angle: float) -> Scene:
        place = 0.65 * float(np.cos(angle)), 0.65 * float(np.sin(angle))
        return Scene(world.cell.tree, [*world.cell.bodies, post(world, *place, 0.02)], Press())

    end = float(way.knots[-1][0])
    near, far = end, end + 0.5
    while far - near > 1e-8:
        angle = 0.5 * (near + far)
        near, far = (angle, far) if densely(at(angle), way, 11) < away else (near, angle)
    return at(far)


@pytest.mark.parametrize(("share", "is_hit"), [(0.95, True), (1.3, False)])
def test_a_way_that_may_be_off_hits_what_it_may_come_too_near_to(
    world: World, share: float, is_hit: bool
) -> None:
    """The true way turns joint 1 by up to the slack further; the bound is little larger than that.

    The post is further from the way itself than is allowed, by a share of the tip's turn.
    """
    slack = 4e-3
    knots = np.array([(1.5, 0.0, -0.05, 0.0), (1.8, 0.0, -0.05, 0.0)])
    scene = beyond(world, Way(knots), NEARER + share * slack * 0.65)
    assert sweep(scene, Way(knots), NEARER).hit is None
    found = sweep(scene, Way(knots, (slack, 0.0, 0.0, 0.0)), NEARER)
    assert (found.hit is not None) is is_hit
    turned = Way(knots + np.array((slack, 0.0, 0.0, 0.0)))
    assert found.at_least <= densely(scene, turned, 11)
    if not is_hit:
        # No more is taken off than the clearance's own share, and what bodies may stray.
        strays = slack * float(scene.bounds[:, 0].max())
        assert found.at_least >= found.nearest.distance - 6e-4 - strays


def test_where_all_may_touch_no_more_than_what_is_allowed_is_promised(world: World) -> None:
    """Of pairs that may touch nobody asks for a clearance: they come no nearer than they may."""
    scene = Scene(world.cell.tree, world.cell.bodies, Press())
    scene.never[:] = False
    found = sweep(scene, straight(world.q, (-2.0, 1.5, -0.05, 1.0)), NEARER)
    assert found.hit is None and found.nearest is None
    assert found.at_least == pytest.approx(NEARER, abs=1e-9)


def test_a_distance_that_the_library_cannot_tell_from_a_hit_is_one(world: World) -> None:
    """What is measured may be 10 um too much: a doubt is never decided for the motion."""
    still = Way(np.array([(1.8, 0.0, -0.05, 0.0)]))
    assert sweep(beyond(world, still, NEARER + 9e-6), still, NEARER).hit is not None
    free = sweep(beyond(world, still, NEARER + 1.2e-5), still, NEARER)
    assert free.hit is None and free.at_least == pytest.approx(NEARER), "not what is measured"


def test_a_pair_is_watched_whatever_order_the_bodies_stand_in(cell: Cell) -> None:
    """Each pair once, those that stand beside each other in the list too."""

    def named(bodies: list[Body]) -> set[frozenset[int]]:
        pairs = watched_pairs(cell.tree, bodies)
        found = [frozenset((id(bodies[p.first]), id(bodies[p.second]))) for p in pairs]
        assert len(set(found)) == len(found) > 0
        return set(found)

    bodies = list(cell.bodies)
    mixed = [bodies[k] for k in np.random.default_rng(4).permutation(len(bodies))]
    assert named(bodies) == named(mixed) == named(bodies[::-1])


@pytest.mark.parametrize(
    ("carrier", "kind", "watched"),
    [
        ("link_2", Kind.ARM, {"base_link", "pallet", "stand_1", "cell_plate"}),
        ("tool0", Kind.ARM, {"base_link", "link_1", "pallet", "stand_1", "cell_plate"}),
        ("table_link", Kind.CELL, {"link_1", "link_2", "tool0"}),
        ("base_link", Kind.CELL, {"link_1", "link_2", "tool0"}),
    ],
)
def test_what_hangs_on_the_arm_beside_the_way_to_its_tool_is_arm(
    world: World, carrier: str, kind: Kind, watched: set[str]
) -> None:
    """A camera is watched against all that its carrier may hit; where the arm moves nothing: cell.

    One joint lies between a camera on link_2 and link_1: it was watched as if it stood there.
    """
    robot = world.cell.robot
    shape = '<collision><geometry><box size="0.05 0.05 0.25"/></geometry></collision>'
    joint = f'<joint name="holder" type="fixed"><parent link="{carrier}"/><child link="camera"/>'
    text = robot.description.read_text(encoding="utf-8").replace(
        "</robot>", f'<link name="camera">{shape}</link>{joint}</joint></robot>'
    )
    model = parse_urdf(text, seen=False)
    bodies = bodies_of(model, robot.tool_frame, [])
    tree = Tree(model, world.cell.tree.joints, [1.0] * len(world.q))
    assert {body.kind for body in bodies if body.name == "camera"} == {kind}
    pairs = [{bodies[p.first].name, bodies[p.second].name} for p in watched_pairs(tree, bodies)]
    against = {name for pair in pairs if "camera" in pair for name in pair - {"camera"}}
    assert watched <= against
    assert ("link_1" in against) is ("link_1" in watched)


def test_the_first_link_is_watched_against_all_that_does_not_carry_it(cell: Cell) -> None:
    """It turns in the base; the plate under it stands beside, wherever the URDF hangs it."""
    bodies = cell.bodies
    pairs = [
        {bodies[p.first].name, bodies[p.second].name} for p in watched_pairs(cell.tree, bodies)
    ]
    assert {"link_1", "base_link"} not in pairs
    assert {"link_1", "cell_plate"} in pairs


def test_a_way_on_which_nothing_goes_anywhere_is_looked_at_on_both_ends() -> None:
    """As where a joint turns that carries no point."""
    assert straight((0.0, 0.0), (0.0, 1.0)).grid(np.array([1.0, 0.0]), 0.01).tolist() == [0.0, 1.0]
    assert Way(np.array([(1.0, 2.0)])).grid(np.ones(2), 0.01).tolist() == [0.0]


@pytest.mark.parametrize(("lower", "upper"), [(-0.3, 0.2), (-0.2, 0.3), (-0.3, -0.1), (0.1, 0.3)])
def test_a_slide_carries_others_as_far_as_its_farther_limit(lower: float, upper: float) -> None:
    """From where the description has it, at 0."""
    assert stroke(lower, upper) == 0.3


def test_a_grid_is_as_fine_as_asked_and_no_finer_on_a_way_of_many_knots() -> None:
    """From its beginning to its end, to and fro both counted."""
    way = Way(np.array([[0.0, 0.0], [0.1, 0.0], [0.5, 1.0], [0.2, -1.0]]))
    reach, spacing = np.array([0.3, 0.6]), 0.05
    u = way.grid(reach, spacing)
    assert (u[0], u[-1]) == (0.0, 3.0)
    assert np.diff(way.travelled(u) @ reach).max() <= spacing + 1e-12
    assert len(u) == np.ceil((0.3 * 0.8 + 0.6 * 3.0) / spacing) + 1
