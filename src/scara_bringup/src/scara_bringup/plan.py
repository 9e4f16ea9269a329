"""Which nodes make a cell, how rosrun starts them, and by what one sees that each is ready."""

from __future__ import annotations

from dataclasses import dataclass

from scara_config.faults import nearest

from scara_bringup.config import Doors


@dataclass(frozen=True)
class NodePlan:
    """One node of the cell.

    Attributes:
        name: Name in messages and of its log.
        package: What rosrun finds it by, with ``executable``.
        executable: Same.
        arguments: Parameters and remappings.
        services: Relative names it offers when it is ready.
        topics: Relative names it publishes when it is ready.
        port: TCP port it listens at when it is ready.
        leaves: When it is ended: 0 first, then 1, and so on.
        optional: The cell goes on without it if it dies.
    """

    name: str
    package: str
    executable: str
    arguments: tuple[str, ...] = ()
    services: tuple[str, ...] = ()
    topics: tuple[str, ...] = ()
    port: int | None = None
    leaves: int = 3
    optional: bool = False


MASTER = NodePlan("rosmaster", "scara_bringup", "master", leaves=5)
ROSOUT = NodePlan("rosout", "scara_bringup", "rosout", topics=("/rosout_agg",), leaves=4)
CONTROLLER = "twin_controller"
EMULATOR = "emulator"
PANEL = "operator_panel"
PENDANT_PAGE = "pendant_page"
JUDGE = "what_if"
HEALTH = "health_watch"
POSE = "joint_pose_controller"
MODELS = "robot_state_publisher"
NOT_OF_THE_TWIN = (EMULATOR, CONTROLLER, PANEL, PENDANT_PAGE, JUDGE, HEALTH, "farm_link")
"""What a twin by itself does without: the real side, what couples the two, and who speaks to it."""
DESK_LINKS = ("_links:=desk",)
"""Robot and twin share this machine: a late process is no lost link.

See links and desk in twin_controller.yaml.
"""


def cell_plan(
    doors: Doors,
    without: tuple[str, ...] = (),
    with_panel: bool = False,
    runs: str = "",
    with_farm: bool = False,
    with_health: bool = False,
) -> list[NodePlan]:
    """List the nodes of a cell, in the order in which they are started.

    Any order works; this one only saves the nodes some waiting. The twin controller ends first, so
    that it can disarm the robot's watchdog while the robot is still there; the recorder next, so
    that it records that.

    Args:
        doors: Where emulator, gateway and operator page will listen.
        without: Names to leave out, for example the emulator when a real robot is there.
        with_panel: Whether what people look at belongs to it, the two pages, the camera and the
            judge, which previews motions: in a cell for people, not in one that runs experiments.
        runs: The folder of all recordings; empty: the nodes' own default.
        with_farm: Whether the cell has a link to the farm. It waits for a desk by itself.
        with_health: Whether the robot tells its motors' torques, by which a cell for people says
            what wears.

    Raises:
        ValueError: ``without`` names a node that is not in the plan; the text lists those that are.
    """
    links = () if EMULATOR in without else DESK_LINKS
    nodes = [
        NodePlan(EMULATOR, "fanuc_emulator", "emulator", links, port=doors.modbus.port),
        NodePlan(
            "simulator",
            "scara_simulation",
            "simulator",
            services=("pause_physics", "step"),
            topics=("twin/joint_states",),
        ),
        NodePlan("gateway", "rosbridge_gateway", "gateway", port=doors.gateway.port),
        NodePlan("kinematics_server", "scara_control", "kinematics_server", services=_KINEMATICS),
        NodePlan(POSE, "scara_control", POSE, services=(f"{POSE}/move",)),
        NodePlan(
            "joint_vel_controller",
            "scara_control",
            "joint_vel_controller",
            topics=("joint_vel_controller/state",),
        ),
        NodePlan("motion_server", "scara_control", "motion_server", services=("move_to",)),
        NodePlan(MODELS, "scara_description", MODELS, topics=("robot_description",)),
        NodePlan(
            "trajectory_server",
            "scara_control",
            "trajectory_server",
            topics=("joint_trajectory_action/status",),
        ),
        NodePlan(
            "recorder",
            "cell_recorder",
            "recorder",
            (f"_directory:={runs}",) if runs else (),
            services=("recorder/start", "recorder/stop"),
            leaves=2,
        ),
        NodePlan(
            "journal",
            "cell_recorder",
            "journal",
            (f"_directory:={runs}",) if runs else (),
            topics=("journal/number",),
        ),
        NodePlan(
            CONTROLLER,
            CONTROLLER,
            CONTROLLER,
            links,
            services=("twin_controller/command",),
            leaves=1,
        ),
    ]
    if with_panel:
        nodes += _for_people(doors, runs, with_pendant=EMULATOR not in without)
    if with_panel and with_health:
        nodes.append(
            NodePlan(
                HEALTH,
                "twin_analysis",
                HEALTH,
                (f"_directory:={runs}",) if runs else (),
                # It offers nothing: this is rospy's own, of each node.
                services=(f"{HEALTH}/get_loggers",),
                optional=True,
            )
        )
    if with_farm:
        folder = (f"_directory:={runs}",) if runs else ()
        nodes.append(
            NodePlan(
                "farm_link",
                "farm",
                "link",
                folder,
                services=("farm/remote",),
                leaves=0,
                optional=True,
            )
        )
    # Without the emulator there is no pendant page either; who leaves out both is right as well.
    known = {node.name for node in nodes} | {*NOT_OF_THE_TWIN}
    unknown = sorted(set(without) - known)
    if unknown:
        meant = nearest(unknown[0], known)
        raise ValueError(
            f"no node is called {', '.join(unknown)}; there are: "
            f"{', '.join(node.name for node in nodes)}"
            + (f"; did you mean {meant}?" if meant else "")
        )
    return [node for node in nodes if node.name not in without]


def _for_people(doors: Doors, runs: str, with_pendant: bool) -> list[NodePlan]:
    """List what shows the cell.

    The pages go first when it ends, so that nobody commands a cell that ends. A real robot brings a
    pendant of its own.
    """
    panel = (f"_runs_dir:={runs}",) if runs else ()
    pendant = NodePlan(
        PENDANT_PAGE, "fanuc_emulator", PENDANT_PAGE, port=doors.pendant.port, leaves=0
    )
    return [
        NodePlan("camera", "scara_simulation", "camera", topics=("camera/image_raw",)),
        NodePlan(PANEL, PANEL, PANEL, panel, port=doors.panel.port, leaves=0),
        NodePlan(JUDGE, JUDGE, JUDGE, services=("what_if/judge",), optional=True),
        *([pendant] if with_pendant else []),
    ]


def experiment_plan(
    output: str, experiments: tuple[str, ...], arguments: tuple[str, ...] = ()
) -> NodePlan:
    """Describe the run of the experiments, which ends by itself; it leaves before all nodes."""
    words = (*experiments, "--output", output, *arguments)
    return NodePlan("run_experiment", "twin_experiments", "run_experiment", words, leaves=0)


def ending_order(nodes: list[NodePlan]) -> tuple[frozenset[str], ...]:
    """Group names by ``leaves``.

    Those of one group end together, after the group before is gone.
    """
    return tuple(
        frozenset(node.name for node in nodes if node.leaves == rank)
        for rank in sorted({node.leaves for node in nodes})
    )


_KINEMATICS = (
    "forward_kinematics",
    "inverse_kinematics",
    "velocity_kinematics",
    "inverse_velocity_kinematics",
)
