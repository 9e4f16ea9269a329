"""Judge motions in a second world, beside the cell and with low priority.

Parameters:
    ~config_dir: Folder with the YAML files (default: the package scara_config).

Topics (in): twin/joint_states, twin/gripper, twin/parts, twin/payload, twin_controller/state,
    joint_pose_controller/state (the cap of moves), people/nearest; what_if/gate, real/joint_states:
    what became of what was judged.

Services:
    what_if/judge (scara_msgs/JudgeMotion).
    what_if/convert (scara_msgs/ConvertProgram): a program's positions in joints or Cartesian.

Publishes what_if/outcomes (scara_msgs/MotionOutcome), and /diagnostics: that this judge runs, and
whether what happens drifts away from what it predicts.
"""

from __future__ import annotations

import os
import threading
import traceback
from dataclasses import replace
from pathlib import Path

import numpy as np
import rospy
from geometry_msgs.msg import Point
from scara_config import ConfigError
from scara_config.frames import TaughtFrame, find_frames
from scara_control.joint_motion import JointMotion, Setpoints
from scara_control.kinematics.base_targets import BaseTargetError, BaseTargets
from scara_ros.diagnosis import Diagnosis, Level
from scara_ros.diagnostics_node import PERIOD_S, Diagnostics
from scara_ros.process.memory_io import give_back, keep_for_good
from scara_ros.shell.ros_node import starting

from scara_msgs.srv import (
    ConvertProgram,
    ConvertProgramResponse,
    JudgeMotion,
    JudgeMotionResponse,
)
from what_if.cell_files_io import description_of, find_program, resting_cell
from what_if.converting import converted_text
from what_if.errors import WhatIfError
from what_if.judging import judge
from what_if.learning.learning_node import Learning
from what_if.live_world_node import LiveWorld
from what_if.motions import JointTarget, Motion, ToolTarget
from what_if.showing.moment import worst_moment
from what_if.showing.samples import Samples, samples_of
from what_if.text import caption_of
from what_if.verdict import Verdict
from what_if.world import Cell

NICENESS = 10
"""Below everything that moves the pair; our choice, as for the operator's page."""
KINDS = ("MOVE", "MOVE_JOINTS", "TRAJECTORY", "PROGRAM")


class WhatIfServer:
    """Answers one question after the other; the engine of the dynamics serves one at a time."""

    def __init__(self, live: LiveWorld, cell: Cell, folder: Path) -> None:
        """Advertise the service."""
        self._live, self._cell, self._folder = live, cell, folder
        self._places = BaseTargets(cell.robot, cell.kinematics.tool)
        self._docked = self._dock_frame()
        self._lock = threading.Lock()
        self._waiting: set[object] = set()  # questions of what moves as soon as it is answered
        self._judged = 0
        self._seen = self._rested = 0  # questions when it was looked last, when memory went back
        self.learning = Learning(cell, cell.config.learning, self._lock)
        # Both subscribe to twin/joint_states, which rospy reads in one thread: a hold holds both.
        live.is_idle = lambda: self.learning.is_idle
        rospy.Service("what_if/judge", JudgeMotion, self._answer)
        rospy.Service("what_if/convert", ConvertProgram, self._convert)

    def diagnosis(self) -> Diagnosis:
        """Return what this node says of itself."""
        text = f"{self._judged} motions judged"
        return Diagnosis(Level.OK, f"{rospy.get_name()}: judge", text)

    def rest(self) -> None:
        """Give memory back once nobody has asked since the last call: a program takes 12 MB."""
        if self._judged == self._seen and self._judged != self._rested:
            give_back()
            self._rested = self._judged
        self._seen = self._judged

    def _answer(self, request: JudgeMotion._request_class) -> JudgeMotionResponse:
        question, looks = object(), bool(request.samples or request.picture)
        if not looks:
            self._waiting.add(question)
        try:
            with self._lock:
                self._waiting.discard(question)
                self._dock()
                at, world = self.learning.expect(), self._live.now()
                if world is None:
                    text = "where the twin stands is not known: wait for twin/joint_states"
                    return JudgeMotionResponse(success=False, message=text)
                motion = self._motion(request, world.q)
                self._judged += 1
                samples = samples_of(world, motion, request.samples) if request.samples else None
                verdict = judge(world, motion, self._give_way) if looks else judge(world, motion)
                self.learning.asked(at, world, motion, verdict)
                moment = worst_moment(world, motion, verdict) if request.picture else None
            answer = answer_of(verdict, self._cell, samples)
            if moment is not None:
                # No gate waits while somebody's picture is drawn; who asks for none needs no paint.
                from what_if.showing.moment_picture_io import picture_of

                answer.picture = picture_of(moment, caption_of(verdict), self._folder)
                answer.picture_time = moment.time
            return answer
        except (WhatIfError, ConfigError, BaseTargetError) as error:
            return JudgeMotionResponse(success=False, message=str(error))
        # A gate waits for the answer: it gets one with the reason, whatever has failed.
        except Exception as error:
            return JudgeMotionResponse(success=False, message=_failure("what_if/judge", error))

    def _give_way(self) -> None:
        """End the answer to somebody who only looks where a move waits, which has less patience.

        Raises:
            WhatIfError: One waits.
        """
        if self._waiting:
            raise WhatIfError("a move is judged first: ask again")

    def _convert(self, request: ConvertProgram._request_class) -> ConvertProgramResponse:
        frame = None if request.frame < 0 else request.frame
        try:
            robot, table = self._cell.robot, find_frames(self._folder)
            text, kept = converted_text(request.text, robot, table, request.to, frame)
        except (WhatIfError, ConfigError) as error:
            return ConvertProgramResponse(success=False, message=str(error))
        # The page that asks shows the reason, whatever has failed.
        except Exception as error:
            return ConvertProgramResponse(success=False, message=_failure("what_if/convert", error))
        return ConvertProgramResponse(success=True, message="; ".join(kept), text=text)

    def _dock_frame(self) -> TaughtFrame | None:
        """Return the frame that tells where the vehicle stands; None: there is none, or no frame.

        Raises:
            ConfigError: frames.yaml is wrong.
        """
        vehicle = self._cell.work.vehicle if self._cell.work else None
        return find_frames(self._folder).numbered("user").get(vehicle.frame) if vehicle else None

    def _dock(self) -> None:
        """Let the vehicle stand where its frame was taught since; a wrong file changes nothing."""
        try:
            frame = self._dock_frame()
            if frame == self._docked:
                return
            moved = description_of(self._cell.robot, self._cell.work, self._folder)
        except ConfigError as error:
            rospy.logwarn_throttle(60.0, f"the vehicle is judged where it stood: {error}")
            return
        self._docked, self._cell = frame, replace(self._cell, description=moved)
        self._live.stand_in(self._cell)

    def _of_arm(self, q: tuple[float, ...]) -> list[float]:
        robot = self._cell.robot
        return [q[robot.twin_joints.index(joint)] for joint in robot.arm_joints]

    def _motion(self, request: JudgeMotion._request_class, q: tuple[float, ...]) -> Motion:
        """Convert a request.

        Raises:
            WhatIfError: There is no such motion, or a count is wrong.
            ConfigError: There is no such program or frame.
            BaseTargetError: The frame has no meaning for this target.
        """
        kind = request.motion.strip().upper()
        if kind == "MOVE":
            yaw = request.yaw if request.has_yaw else None
            place = (request.x, request.y, request.z)
            if request.frame or request.tool:
                frames, taught = (request.frame, request.tool), find_frames(self._folder)
                place, yaw = self._places.in_base(taught, place, yaw, frames, self._of_arm(q))
            speeds = request.speed_percent, request.path, request.speed_mm_s
            return ToolTarget(*place, yaw, request.elbow, *speeds)
        if kind == "MOVE_JOINTS":
            q, via = tuple(request.joint_positions), tuple(request.via)
            speeds = request.speed_percent, request.path, request.speed_mm_s
            return JointTarget(q, *speeds, via, request.corner_mm)
        if kind == "PROGRAM":
            return find_program(self._cell, request.program, self._folder)
        if kind == "TRAJECTORY":
            # Convert a request's points
            count, width = len(request.times), len(request.name)
            rows: list[list[tuple[float, ...]]] = []
            for what, optional in (
                ("positions", False),
                ("velocities", True),
                ("accelerations", True),
            ):
                values = getattr(request, what)
                if optional and not values:
                    rows.append([()] * count)
                    continue
                if len(values) != count * width or not count * width:
                    raise WhatIfError(
                        f"{what} = {len(values)} values: expected {count} points of {width} joints"
                    )
                table = np.array(values).reshape(count, width)
                given = np.isfinite(table).all(axis=1) | (not optional)
                rows.append([tuple(row) if has else () for row, has in zip(table.tolist(), given)])
            points = tuple(
                JointMotion(q, qdot, qddot, float(at))
                for q, qdot, qddot, at in zip(*rows, request.times)
            )
            return Setpoints(tuple(request.name), points)
        raise WhatIfError(f"motion = {request.motion!r}: allowed are {', '.join(KINDS)}")


def answer_of(verdict: Verdict, cell: Cell, samples: Samples | None) -> JudgeMotionResponse:
    """Convert a verdict to the service's answer; lengths become [m]."""
    first = verdict.reasons[0] if verdict.reasons else None
    near = verdict.clearance
    place = Point()
    if first is not None and first.place_mm is not None:
        place = Point(*(1e-3 * value for value in first.place_mm))
    return JudgeMotionResponse(
        success=True,
        message=verdict.sentence,
        verdict=verdict.outcome.value,
        cause=first.cause.value if first else "",
        time=first.time_s if first else 0.0,
        step=first.step if first else "",
        place=place,
        duration=verdict.duration_s,
        duration_spread=verdict.duration_spread_s,
        clearance=1e-3 * near.distance_mm if near else -1.0,
        clearance_between=list(near.between) if near else [],
        clearance_time=near.time_s if near else 0.0,
        joint=[joint.name for joint in cell.robot.twin_joints],
        speed_used_percent=[use.speed_percent for use in verdict.joints],
        acceleration_used_percent=[use.acceleration_percent for use in verdict.joints],
        effort_used_percent=[use.effort_percent for use in verdict.joints],
        tool_speed=1e-3 * verdict.tool_speed_mm_s,
        zones=list(verdict.zones),
        placed=list(verdict.placed),
        dropped=list(verdict.dropped),
        energy=verdict.energy_j,
        target=list(verdict.target),
        **(_sampled(samples) if samples is not None else {}),
    )


def _sampled(samples: Samples) -> dict[str, list[float]]:
    """Return the fields of the answer that show the whole motion."""
    clearance = np.where(np.isfinite(samples.clearance), samples.clearance, -1.0)
    return {
        "sample_times": list(samples.way.times),
        "sample_positions": [value for point in samples.way.points for value in point.q],
        "sample_clearance": clearance.tolist(),
        "sample_speed": samples.speed.tolist(),
    }


def _report(server: WhatIfServer) -> None:
    """Tell that this judge runs, until the node ends."""
    ended = threading.Event()
    rospy.core.add_shutdown_hook(lambda reason: ended.set())
    diagnostics = Diagnostics("what_if")
    while True:
        diagnostics.publish(server.diagnosis(), server.learning.diagnosis)
        if ended.wait(PERIOD_S):
            return
        server.rest()


def _failure(service: str, error: Exception) -> str:
    """Log what nobody has foreseen, and return what to answer."""
    rospy.logerr("%s failed:\n%s", service, traceback.format_exc())
    return f"{service} failed: {type(error).__name__}: {error}"


def main() -> None:
    """Start the node and answer until it is told to end."""
    os.nice(NICENESS)
    with starting("what_if") as folder, resting_cell(folder) as (base, models):
        server = WhatIfServer(LiveWorld(base, models), base.cell, folder)
        give_back()
        keep_for_good()
        rospy.loginfo("what_if is ready")
        _report(server)
