"""The plan of a cell is data: names, ready signs and the order of leaving."""

from __future__ import annotations

import pytest
from scara_bringup.config import Doors
from scara_bringup.plan import NOT_OF_THE_TWIN, cell_plan, ending_order, experiment_plan
from scara_config.quantities import ServerAddress

DOORS = Doors(
    modbus=ServerAddress("127.0.0.1", 15020),
    gateway=ServerAddress("127.0.0.1", 19090),
    panel=ServerAddress("127.0.0.1", 18080),
    pendant=ServerAddress("127.0.0.1", 18090),
)
PLAN = cell_plan(DOORS)


def test_recorder_and_page_are_told_one_folder_of_runs() -> None:
    """What the page records, the recorder may write."""
    told = {node.name: node.arguments for node in cell_plan(DOORS, (), True, runs="/data/runs")}
    assert "_directory:=/data/runs" in told["recorder"]
    assert "_directory:=/data/runs" in told["journal"]
    assert "_runs_dir:=/data/runs" in told["operator_panel"]


def test_plan_holds_every_node_of_the_design() -> None:
    """A cell is these twelve nodes, each once."""
    names = [node.name for node in PLAN]
    assert len(set(names)) == len(names)
    assert set(names) == {
        "simulator",
        "gateway",
        "kinematics_server",
        "joint_pose_controller",
        "joint_vel_controller",
        "motion_server",
        "trajectory_server",
        "emulator",
        "recorder",
        "journal",
        "robot_state_publisher",
        "twin_controller",
    }


def test_a_twin_by_itself_has_no_robot_and_nobody_who_couples_it() -> None:
    """Its motion nodes, its gateway and its recordings stay."""
    twin = cell_plan(DOORS, NOT_OF_THE_TWIN, with_panel=True, with_farm=True, with_health=True)
    left = {node.name for node in twin}
    gone = {"emulator", "twin_controller", "operator_panel", "pendant_page", "what_if", "farm_link"}
    assert not left & {*gone, "health_watch"}
    assert {node.name for node in PLAN} - gone < left


def test_ports_of_the_plan_are_those_of_the_configuration() -> None:
    """What is checked for a listener is what the nodes will open."""
    assert {node.name: node.port for node in PLAN if node.port} == {
        "emulator": 15020,
        "gateway": 19090,
    }


def test_pages_camera_and_judge_belong_to_a_cell_for_people_only() -> None:
    """People do without the judge if it ends; a page goes first, so that nobody commands an end."""
    added = {node.name: node for node in cell_plan(DOORS, with_panel=True) if node not in PLAN}
    assert set(added) == {"camera", "operator_panel", "pendant_page", "what_if"}
    assert {name for name, node in added.items() if node.optional} == {"what_if"}
    assert added["operator_panel"].port == 18080 and added["pendant_page"].port == 18090
    pages = frozenset({"operator_panel", "pendant_page"})
    assert ending_order(cell_plan(DOORS, with_panel=True))[0] == pages


def test_wear_is_watched_in_a_cell_for_people_whose_robot_tells_torques() -> None:
    """It keeps its first week where the recordings are, and the cell does without it if it ends."""
    (watch,) = {*cell_plan(DOORS, (), True, "/r", with_health=True)} - {
        *cell_plan(DOORS, (), True, "/r")
    }
    assert (watch.name, watch.arguments, watch.optional) == (
        "health_watch",
        ("_directory:=/r",),
        True,
    )
    assert [node.name for node in cell_plan(DOORS, with_health=True)] == [n.name for n in PLAN]


def test_pendant_page_goes_with_the_stand_in() -> None:
    """A real robot brings a pendant of its own; to leave out both by name is no mistake."""
    for without in (("emulator",), ("emulator", "pendant_page")):
        names = [node.name for node in cell_plan(DOORS, without, with_panel=True)]
        assert "operator_panel" in names and "pendant_page" not in names


def test_every_node_shows_a_sign_of_readiness() -> None:
    """A node without a sign could be missing unseen."""
    nodes = cell_plan(DOORS, with_panel=True, with_health=True)
    assert [node.name for node in nodes if not (node.services or node.topics or node.port)] == []


def test_left_out_node_is_not_in_the_plan() -> None:
    """A cell with a real robot has no emulator."""
    assert "emulator" not in [node.name for node in cell_plan(DOORS, ("emulator",))]


def test_unknown_node_to_leave_out_is_refused_with_the_known_ones() -> None:
    """A typing error must not start a second robot beside the real one."""
    with pytest.raises(
        ValueError, match=r"emulatr; there are: .*emulator.*; did you mean emulator\?"
    ):
        cell_plan(DOORS, ("emulatr",))


def test_controller_leaves_before_the_recorder_and_both_before_the_rest() -> None:
    """See cell_plan: the watchdog is disarmed while the robot is there, and recorded."""
    order = ending_order([*PLAN, experiment_plan("runs/x", ("real_leads",))])
    assert order[:3] == (
        frozenset({"run_experiment"}),
        frozenset({"twin_controller"}),
        frozenset({"recorder"}),
    )


def test_experiments_get_their_output_folder_and_arguments() -> None:
    """The words are those of docs/interfaces.md."""
    node = experiment_plan("runs/x", ("real_leads", "twin_leads"), ("--speed", "30"))
    assert node.arguments == ("real_leads", "twin_leads", "--output", "runs/x", "--speed", "30")


def test_links_are_those_of_a_desk_only_where_the_robot_is_the_stand_in() -> None:
    """A real robot keeps the strict limits, and no other node is told anything."""

    def told(without: tuple[str, ...]) -> set[str]:
        plan = cell_plan(DOORS, without, with_panel=True)
        return {node.name for node in plan if "_links:=desk" in node.arguments}

    assert told(()) == {"emulator", "twin_controller"}
    assert told(("emulator",)) == set()
