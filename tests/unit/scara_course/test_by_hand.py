"""Exercises 1 to 3: the textbook's own code passes, ten usual mistakes are each told by name.

The model solutions are modern_robotics'; the wrong ones follow the card in complex numbers, with
one step done wrong.
"""

from __future__ import annotations

import cmath
import math
import re
from collections.abc import Callable
from typing import Any

import modern_robotics as mr
import numpy as np
import pytest
from harness.course import LEARNER, exercise, handed_in, marked, robot
from scara_course.exercises_io import draw

M = np.array([[0, -1, 0, 0.65], [-1, 0, 0, 0], [0, 0, -1, 0.160], [0, 0, 0, 1.0]])
SCREWS = np.array([[0, 0, 1, 0, 0, 0], [0, 0, 1, 0, -0.35, 0], [0, 0, 0, 0, 0, 1.0]]).T
JOINTS = "joint_1_deg", "joint_2_deg", "joint_3_mm"
LEARNERS = [LEARNER, *(f"learner_{k}" for k in range(8))]
DEGREE = math.pi / 180.0
Numbers = dict[str, dict[str, Any]]


def given(number: int, learner: str = LEARNER) -> Numbers:
    """Return a learner's numbers."""
    return draw(exercise(number), learner)


def textbook_pose(q1: float, q2: float, q3: float) -> np.ndarray:
    """Return T_sb in mm by the textbook's code, joints in deg and mm."""
    T = mr.FKinSpace(M, SCREWS, np.array([q1 * DEGREE, q2 * DEGREE, q3 / 1e3]))
    return T[:3, 3] * 1e3


def textbook_1(learner: str) -> Numbers:
    """Solve exercise 1."""
    names = "x_mm", "y_mm", "z_mm"
    return {
        row: dict(zip(names, textbook_pose(*values.values())))
        for row, values in given(1, learner).items()
    }


def textbook_2(learner: str) -> Numbers:
    """Solve exercise 2: iterate from a bend to each side."""
    found = {}
    for row, p in given(2, learner).items():
        x, y, z = (p[name] / 1e3 for name in ("x_mm", "y_mm", "z_mm"))
        for elbow, side in (("righty", 1.0), ("lefty", -1.0)):
            q = _newton(np.array([x, y, z]), math.atan2(y, x) - 0.5 * side, side)
            values = np.degrees(q[0]), np.degrees(q[1]), q[2] * 1e3
            found[f"{row}_{elbow}"] = dict(
                zip(("joint_1_deg", "joint_2_deg", "joint_3_mm"), values)
            )
    return found


def _newton(target: np.ndarray, q1: float, q2: float) -> np.ndarray:
    q = np.array([q1, q2, 0.0])
    for _ in range(50):
        q += np.linalg.solve(textbook_tip(q), target - mr.FKinSpace(M, SCREWS, q)[:3, 3])
    return q


def textbook_tip(q: np.ndarray) -> np.ndarray:
    """Return the tool's velocity for each joint: the body Jacobian, turned into the base frame."""
    T = mr.FKinSpace(M, SCREWS, q)
    screws = np.column_stack([mr.Adjoint(mr.TransInv(M)) @ S for S in SCREWS.T])
    return T[:3, :3] @ mr.JacobianBody(screws, q)[3:]


def textbook_3(learner: str) -> Numbers:
    """Solve exercise 3."""
    found: Numbers = {}
    for row, values in given(3, learner).items():
        q = np.array([values["joint_1_deg"] * DEGREE, values["joint_2_deg"] * DEGREE, -0.1])
        J = textbook_tip(q)[:2, :2]
        names = "x_by_joint_1_m", "x_by_joint_2_m", "y_by_joint_1_m", "y_by_joint_2_m"
        found[row] = {**dict(zip(names, J.ravel())), "det_m2": np.linalg.det(J)}
    weakest = np.linalg.svd(textbook_tip(np.array([0.0, 0.0, -0.1]))[:2, :2])[0][:, -1]
    found["P1"]["lost_direction"] = "xy"[np.abs(weakest).argmax()]
    turning = np.array([given(3, learner)["bent"][f"speed_{n}_deg_s"] for n in (1, 2)]) * DEGREE
    J = np.array(list(found["bent"].values())[:4]).reshape(2, 2)
    found["bent"] |= dict(zip(("vx_mm_s", "vy_mm_s"), J @ turning * 1e3))
    return found


def rounded(answers: Numbers) -> Numbers:
    """Round as the cards ask for."""
    digits = {"_deg": 2, "_mm": 1, "_mm_s": 1, "_m": 3, "_m2": 4}
    return {
        row: {
            name: value
            if isinstance(value, str)
            else round(float(value), next(n for unit, n in digits.items() if name.endswith(unit)))
            for name, value in values.items()
        }
        for row, values in answers.items()
    }


@pytest.mark.parametrize("learner", LEARNERS)
@pytest.mark.parametrize("number, solve", [(1, textbook_1), (2, textbook_2), (3, textbook_3)])
def test_the_textbooks_code_passes_with_rounded_answers(
    number: int, solve: Callable[[str], Numbers], learner: str
) -> None:
    """A second opinion on every answer, for many learners' numbers."""
    verdict = marked(number, handed_in(number, rounded(solve(learner)), learner), learner)
    assert verdict.passed, verdict.reason


def on_card_1(place: Callable[[float, float], complex], z: Callable[[float], float]) -> Numbers:
    """Follow card 1: the plane as complex numbers, angles in rad."""
    found = {}
    for row, values in given(1).items():
        q1, q2, q3 = values.values()
        at = place(q1 * DEGREE, q2 * DEGREE)
        found[row] = {"x_mm": at.real, "y_mm": at.imag, "z_mm": z(q3)}
    return found


def arms(first: float, second: float, a: float = 350.0, b: float = 300.0) -> complex:
    """Add both arms by their directions."""
    return cmath.rect(a, first) + cmath.rect(b, second)


def right_z(q3: float) -> float:
    """Follow step 4."""
    return 160.0 + q3


WRONG_1 = {
    "joint_1 \\+ joint_2": on_card_1(lambda p, q: arms(p, q), right_z),
    "the sum, not the difference": on_card_1(lambda p, q: arms(p, p - q), right_z),
    "your calculator takes radians": on_card_1(
        lambda p, q: arms(p / DEGREE, (p + q) / DEGREE), right_z
    ),
    "the first one is the longer": on_card_1(lambda p, q: arms(p, p + q, 300.0, 350.0), right_z),
    "x takes the cosine": on_card_1(lambda p, q: 1j * arms(p, p + q).conjugate(), right_z),
    "anticlockwise from x": on_card_1(lambda p, q: arms(-p, -p - q), right_z),
    "z begins at the height": on_card_1(lambda p, q: arms(p, p + q), lambda q3: q3),
    "positive upwards": on_card_1(lambda p, q: arms(p, p + q), lambda q3: 160.0 - q3),
    "the second arm is missing": on_card_1(lambda p, q: arms(p, 0.0, b=0.0), right_z),
    "in mm, not in m": on_card_1(lambda p, q: arms(p, p + q) / 1e3, lambda q3: right_z(q3) / 1e3),
}


def on_card_2(change: Callable[[dict[str, float]], tuple[float, float, float]]) -> Numbers:
    """Follow card 2; ``change`` makes the joints of one point and elbow of its quantities."""
    found = {}
    for row, p in given(2).items():
        x, y, z = p["x_mm"], p["y_mm"], p["z_mm"]
        r2 = x * x + y * y
        beta = math.degrees(math.acos((350.0**2 + 300.0**2 - r2) / (2 * 350.0 * 300.0)))
        alpha = math.degrees(math.acos((r2 + 350.0**2 - 300.0**2) / (700.0 * math.sqrt(r2))))
        second = math.degrees(math.acos((r2 + 300.0**2 - 350.0**2) / (600.0 * math.sqrt(r2))))
        for elbow, s in (("righty", 1), ("lefty", -1)):
            known = dict(x=x, y=y, z=z, s=s, alpha=alpha, beta=beta, second=second)
            known["gamma"] = math.degrees(math.atan2(y, x))
            joints = change(known)
            found[f"{row}_{elbow}"] = dict(
                zip(("joint_1_deg", "joint_2_deg", "joint_3_mm"), joints)
            )
    return found


def card_2(k: dict[str, float], **other: float) -> tuple[float, float, float]:
    """Follow steps 5 to 7, with some quantities changed."""
    k = {**k, **other}
    return (
        k["gamma"] - k["s"] * k["alpha"],
        k["s"] * (180.0 - k["beta"]),
        k["z"] - k.get("h", 160.0),
    )


WRONG_2 = {
    "righty and lefty are swapped": on_card_2(lambda k: card_2(k, s=-k["s"])),
    "what is left of 180": on_card_2(lambda k: card_2(k, beta=180.0 - k["beta"])),
    "alpha is missing": on_card_2(lambda k: card_2(k, alpha=0.0)),
    "alpha has the wrong sign": on_card_2(lambda k: card_2(k, alpha=-k["alpha"])),
    "use atan2": on_card_2(lambda k: card_2(k, gamma=math.degrees(math.atan(k["y"] / k["x"])))),
    "atan2\\(y, x\\), in this": on_card_2(
        lambda k: card_2(k, gamma=90.0 - math.degrees(math.atan2(k["y"], k["x"])))
    ),
    "not in radians": on_card_2(
        lambda k: (card_2(k)[0] * DEGREE, card_2(k)[1] * DEGREE, card_2(k)[2])
    ),
    "alpha belongs to the first arm": on_card_2(lambda k: card_2(k, alpha=k["second"])),
    "height of the tool, h, is missing": on_card_2(lambda k: card_2(k, h=0.0)),
    "joint_3 is z less h": on_card_2(lambda k: (*card_2(k)[:2], 160.0 - k["z"])),
}


def on_card_3(
    derive: Callable[[float, float], np.ndarray],
    det: Callable[[np.ndarray], float] = lambda J: J[0, 0] * J[1, 1] - J[0, 1] * J[1, 0],
    lost: str = "x",
    radians: float = DEGREE,
) -> Numbers:
    """Follow card 3."""
    found: Numbers = {}
    for row, values in given(3).items():
        J = derive(values["joint_1_deg"] * DEGREE, values["joint_2_deg"] * DEGREE)
        names = "x_by_joint_1_m", "x_by_joint_2_m", "y_by_joint_1_m", "y_by_joint_2_m"
        found[row] = {**dict(zip(names, map(float, J.ravel()))), "det_m2": float(det(J))}
    found["P1"]["lost_direction"] = lost
    w = np.array([values["speed_1_deg_s"], values["speed_2_deg_s"]]) * radians
    found["bent"] |= dict(zip(("vx_mm_s", "vy_mm_s"), map(float, J @ w * 1e3)))
    return found


def card_3(p: float, q: float, first: float = 0.35, second: float = 0.3) -> np.ndarray:
    """Follow the table; ``first`` and ``second`` are the lengths in the column of joint_1."""
    both = p + q
    return np.array(
        [
            [-first * math.sin(p) - second * math.sin(both), -0.3 * math.sin(both)],
            [first * math.cos(p) + second * math.cos(both), 0.3 * math.cos(both)],
        ]
    )


WRONG_3 = {
    "yours is turned over": on_card_3(lambda p, q: card_3(p, q).T),
    "space Jacobian": on_card_3(
        lambda p, q: np.array([[0.0, 0.35 * math.sin(p)], [0.0, -0.35 * math.cos(p)]])
    ),
    "moves the second arm too": on_card_3(lambda p, q: card_3(p, q, second=0.0)),
    "moves the first arm too": on_card_3(lambda p, q: card_3(p, q, first=0.0)),
    "for one degree": on_card_3(lambda p, q: card_3(p, q) * DEGREE, radians=1.0),
    "this is in mm": on_card_3(lambda p, q: card_3(p, q) * 1e3, radians=DEGREE / 1e3),
    "minus the sine": on_card_3(lambda p, q: np.diag([-1.0, 1.0]) @ card_3(p, q)),
    "in radians a second": on_card_3(card_3, radians=1.0),
    "its sign": on_card_3(card_3, lambda J: J[0, 1] * J[1, 0] - J[0, 0] * J[1, 1]),
    "at P1 it points along x": on_card_3(card_3, lost="y"),
}
WRONG = [
    pytest.param(number, reason, answers, id=f"{number}: {reason}")
    for number, wrong in ((1, WRONG_1), (2, WRONG_2), (3, WRONG_3))
    for reason, answers in wrong.items()
]


def test_each_exercise_has_ten_wrong_solutions() -> None:
    """As many as the course promises."""
    assert [len(wrong) for wrong in (WRONG_1, WRONG_2, WRONG_3)] == [10, 10, 10]


@pytest.mark.parametrize("number, reason, answers", WRONG)
def test_a_usual_mistake_is_refused_and_named(number: int, reason: str, answers: Numbers) -> None:
    """The verdict says what was done wrong, not only that it is."""
    verdict = marked(number, handed_in(number, answers))
    assert not verdict.passed
    assert re.search(reason, verdict.reason), verdict.reason


def test_the_examples_on_the_cards_are_right() -> None:
    """Whoever follows a card word by word comes to its example."""
    solve = [exercise(number).check.solve for number in (1, 2, 3)]
    pose = {"joint_1_deg": 30, "joint_2_deg": 40, "joint_3_mm": -60}
    (place,) = solve[0]({"a": pose}, robot()).values()
    assert (
        f"x = {place['x_mm']:.1f}, y = {place['y_mm']:.1f}, z = {place['z_mm']:.1f}"
        in exercise(1).card
    )
    joints = solve[1]({"a": {"x_mm": 510, "y_mm": 160, "z_mm": 100}}, robot())
    for elbow, values in zip(("righty", "lefty"), joints.values()):
        q1, q2, q3 = values.values()
        assert f"{elbow} {q1:.2f}, {q2:.2f}, {q3:.0f}" in exercise(2).card
    bent = {"joint_1_deg": 30, "joint_2_deg": 40, "speed_1_deg_s": 10, "speed_2_deg_s": -20}
    *J, det, vx, vy = solve[2]({"P1": {"a": 0, "b": 0}, "bent": bent}, robot())["bent"].values()
    text = " ".join(exercise(3).card.split())
    assert ", ".join(f"{each:.4f}" for each in J) in text
    assert f"determinant {det:.4f}; vx = {vx:.1f} and vy = {vy:.1f} mm/s" in text
