"""Which nodes make a cell, how rosrun starts them, and by what one sees that each is ready."""

from __future__ import annotations

from dataclasses import dataclass

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
        urgent: It holds a loop that others wait for: on a busy machine it goes first, where the system allows that.
    """

    name: str
    package: str
    executable: str
    arguments: tuple[str, ...] = ()
    services: tuple[str, ...] = ()
    topics: tuple[str, ...] = ()
    port: int | None = None
    leaves: int = 3
    urgent: bool = False


MASTER = NodePlan("rosmaster", "", "rosmaster", leaves=5)
ROSOUT = NodePlan("rosout", "rosout", "rosout", leaves=4)
CONTROLLER = "twin_controller"
PANEL = "operator_panel"
POSE = "joint_pose_controller"
REAL_DESCRIPTION = "real/robot_description"


def cell_plan(doors: Doors, without: tuple[str, ...] = (), with_panel: bool = False) -> list[NodePlan]:
    """List the nodes of a cell, in the order in which they are started.

    Any order works; this one only saves the nodes some waiting. The twin controller ends first, so that it can
    disarm the robot's watchdog while the robot is still there; the recorder next, so that it records that.

    Args:
        doors: Where emulator, gateway and operator page will listen.
        without: Names to leave out, for example the emulator when a real robot is there.
        with_panel: Whether what people look at belongs to it, the operator page, the camera and the real robot's model in
            RViz: in a cell for people, not in one that runs experiments.

    Raises:
        ValueError: ``without`` names a node that is not in the plan; the text lists those that are.
    """
    nodes = [
        NodePlan("robot_state_publisher", "robot_state_publisher", "robot_state_publisher", ("joint_states:=twin/joint_states",)),
        NodePlan("emulator", "fanuc_emulator", "emulator", port=doors.modbus.port, urgent=True),
        NodePlan(
            "simulator",
            "scara_simulation",
            "simulator",
            services=("pause_physics", "step"),
            topics=("twin/joint_states",),
            urgent=True,
        ),
        NodePlan("gateway", "scara_simulation", "gateway", port=doors.gateway.port, urgent=True),
        NodePlan("kinematics_server", "scara_control", "kinematics_server", services=_KINEMATICS),
        NodePlan(POSE, "scara_control", POSE, services=(f"{POSE}/move",), urgent=True),
        NodePlan("joint_vel_controller", "scara_control", "joint_vel_controller", topics=("joint_vel_controller/state",)),
        NodePlan("motion_server", "scara_control", "motion_server", services=("move_to",)),
        NodePlan("trajectory_server", "scara_control", "trajectory_server", topics=("joint_trajectory_action/status",)),
        NodePlan("recorder", CONTROLLER, "recorder", services=("recorder/start", "recorder/stop"), leaves=2),
        NodePlan(CONTROLLER, CONTROLLER, CONTROLLER, services=("twin_controller/command",), leaves=1, urgent=True),
    ]
    if with_panel:
        nodes += _for_people(doors)
    unknown = sorted(set(without) - {node.name for node in nodes})
    if unknown:
        raise ValueError(f"no node is called {', '.join(unknown)}; there are: {', '.join(node.name for node in nodes)}")
    return [node for node in nodes if node.name not in without]


def _for_people(doors: Doors) -> list[NodePlan]:
    """List what shows the cell; the page goes first when it ends, so that nobody commands a cell that ends."""
    publisher = "robot_state_publisher"
    model = ("__name:=real_state_publisher", "joint_states:=real/joint_states", f"robot_description:={REAL_DESCRIPTION}")
    return [
        NodePlan("real_state_publisher", publisher, publisher, model),
        NodePlan("camera", "scara_simulation", "camera", topics=("camera/image_raw",)),
        NodePlan(PANEL, PANEL, PANEL, port=doors.panel.port, leaves=0),
    ]


def experiment_plan(output: str, experiments: tuple[str, ...], arguments: tuple[str, ...] = ()) -> NodePlan:
    """Describe the run of the experiments, which ends by itself; it leaves before all nodes."""
    words = (*experiments, "--output", output, *arguments)
    return NodePlan("run_experiment", "twin_experiments", "run_experiment", words, leaves=0)


def ending_order(nodes: list[NodePlan]) -> tuple[frozenset[str], ...]:
    """Group names by ``leaves``: those of one group end together, after the group before is gone."""
    return tuple(
        frozenset(node.name for node in nodes if node.leaves == rank) for rank in sorted({node.leaves for node in nodes})
    )


_KINEMATICS = ("forward_kinematics", "inverse_kinematics", "velocity_kinematics", "inverse_velocity_kinematics")
