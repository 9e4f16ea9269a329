"""A command is followed to its end, and says how it ended."""

from __future__ import annotations

from typing import Any

import msgspec
import pytest
from operator_panel.door import Answer
from operator_panel.view.progress import GRACE_S, PROGRAM_GRACE_S, Command, CommandLog, Fate
from operator_panel.view.snapshot import CellState, RobotPackage, Snapshot

YES = Answer(True, "OPERATOR_LEADS: both are commanded")


def told(mode: str, why: str = "", still: bool = False, **fields: Any) -> Snapshot:
    """Return what the controller says in a mode; the robot is heard."""
    package = fields.pop("package", None)
    fields |= {"real_standing_still": still, "twin_standing_still": still}
    state = CellState(mode, why=why, real_position=(0.0,), **fields)
    return Snapshot(master=True, state=state, package=package)


class Followed:
    """One command, and its time."""

    def __init__(self, kind: str, answer: Answer | None = YES) -> None:
        """Send it at 0 s."""
        self.log, self.now = CommandLog(), 0.0
        self.number = self.log.begin(kind, kind.capitalize(), "operator 1", "14:03:22", 0.0)
        if answer is not None:
            self.log.answered(self.number, answer, 0.01)

    def sees(self, *snapshots: Snapshot, after: float = 0.05, silent: bool = False) -> Command:
        """Look at each of them; return the command then."""
        for snapshot in snapshots:
            self.now += after
            self.log.look(snapshot, silent, self.now)
        return self.command

    @property
    def command(self) -> Command:
        """The command as the page shows it."""
        return next(c for c in self.log.shown if c.number == self.number)


def test_move_runs_until_both_stand_at_its_target() -> None:
    """A new mode may come a moment after the answer."""
    move = Followed("MOVE")
    assert move.command.text == "both robots move"
    assert move.sees(told("IDLE", still=True)).outcome is Fate.RUNNING
    assert move.sees(told("OPERATOR_LEADS")).outcome is Fate.RUNNING
    done = move.sees(told("IDLE", still=True))
    assert (done.outcome, done.tone) == (Fate.DONE, "good")
    assert move.log.take_ended() == [done] and move.log.take_ended() == []


@pytest.mark.parametrize(
    ("after", "outcome"),
    [
        (told("STOPPED", "STOP: the target is cleared"), Fate.STOPPED),
        (told("ESTOP", "ESTOP: latched"), Fate.STOPPED),
        (told("FAULT", "a fault"), Fate.STOPPED),
        (told("REAL_LEADS", "the real robot wins"), Fate.STOPPED),
        (told("OFFLINE", "a link is down"), Fate.LOST),
        (told("PAUSED", "PAUSE: the target is kept"), Fate.PAUSED),
        (told("IDLE", still=True, move_failed="joint_2 was taken"), Fate.STOPPED),
    ],
)
def test_move_that_does_not_get_there_is_never_green_and_says_why(
    after: Snapshot, outcome: Fate
) -> None:
    """Whatever ends it."""
    command = Followed("MOVE").sees(told("OPERATOR_LEADS"), after)
    assert command.outcome is outcome and command.tone in ("warn", "bad") and command.text


def test_refused_command_shows_the_reason_without_codes() -> None:
    """And what has ended changes no more."""
    refused = Followed("HOME", Answer(False, "HOME: something else leads: STOP first"))
    assert refused.command.text == "Something else leads: STOP first"
    assert refused.sees(told("IDLE", still=True)).outcome is Fate.REFUSED
    assert refused.command.tone == "bad"


def test_command_without_an_answer_is_lost_and_so_is_one_of_a_silent_controller() -> None:
    """Nobody knows whether it was done."""
    lost = Followed("MOVE", Answer(False, "did not answer within 3 s", lost=True))
    assert (lost.command.outcome, lost.command.tone) == (Fate.LOST, "bad")
    silent = Followed("MOVE").sees(told("OPERATOR_LEADS"), silent=True)
    assert silent.outcome is Fate.LOST and "look at the robots" in silent.text
    waiting = Followed("MOVE", None).sees(told("IDLE"), silent=True)
    assert waiting.outcome is Fate.SENT, "its answer still comes, or its time runs out"


AT_TARGET = told("IDLE", still=True)
LEADS = told("OPERATOR_LEADS")


@pytest.mark.parametrize(
    ("kind", "seen", "after", "outcomes"),
    [
        # No mode tells of a move to where the pair stands.
        ("MOVE", [AT_TARGET], GRACE_S + 0.1, ["done"]),
        ("MOVE", [LEADS, told("PAUSED"), LEADS, AT_TARGET], 0.05, ["paused", "running", "done"]),
        # Received and at standstill are told apart.
        ("STOP", [told("STOPPED"), told("STOPPED", still=True)], 0.05, ["running", "done"]),
        ("ESTOP", [told("ESTOP"), told("ESTOP", still=True)], 0.05, ["running", "done"]),
        ("PAUSE", [told("PAUSED"), told("PAUSED", still=True)], 0.05, ["running", "done"]),
        ("RESUME", [told("PAUSED"), told("OPERATOR_LEADS")], 0.05, ["running", "done"]),
        ("RESUME", [told("PAUSED"), told("IDLE", "nothing is left")], 0.05, ["running", "done"]),
        ("RESUME", [told("PAUSED", "its cause persists")], 6.0, ["refused"]),
        # What has stopped the pair right behind it goes on with nothing.
        ("RESUME", [told("PAUSED"), told("ESTOP")], 0.05, ["running", "stopped"]),
        ("RESUME", [told("FAULT")], 0.05, ["stopped"]),
        ("RESUME", [told("STOPPED")], 0.05, ["stopped"]),
        ("RESUME", [told("STANDSTILL")], 0.05, ["stopped"]),
        ("RESUME", [told("OFFLINE")], 0.05, ["lost"]),
        # A reset may take seconds; one whose cause persists is no success.
        ("RESET", [told("FAULT"), told("STOPPED")], 0.05, ["running", "done"]),
        ("RESET", [told("FAULT", "its cause persists")], 6.0, ["refused"]),
    ],
)
def test_command_ends_with_what_the_controller_says(
    kind: str, seen: list[Snapshot], after: float, outcomes: list[str]
) -> None:
    """A stop that is done is never green; a refusal says why."""
    followed = Followed(kind)
    commands = [followed.sees(snapshot, after=after) for snapshot in seen]
    assert [command.outcome for command in commands][-len(outcomes) :] == outcomes
    if kind in ("STOP", "ESTOP", "PAUSE"):
        assert commands[-1].tone == "warn"
    if outcomes == ["refused"]:
        assert commands[-1].text == "Its cause persists"
    if (kind, seen[-1].state.mode) == ("RESUME", "IDLE"):
        assert commands[-1].text == "Nothing is left", "nothing goes on"


def test_program_tells_its_line_until_it_ends() -> None:
    """It may wait before its first motion."""
    package = RobotPackage("program", 50.0, True, True, "ARTICLE line 3 running")
    program = Followed("RUN")
    assert program.sees(told("IDLE", package=package), after=PROGRAM_GRACE_S + 1.0).text == (
        "ARTICLE line 3 running, the twin follows"
    )
    program.sees(told("REAL_LEADS", package=package))
    ended = told("IDLE", still=True, package=msgspec.structs.replace(package, running=False))
    assert program.sees(ended).outcome is Fate.DONE


def test_what_was_asked_last_stands_first_and_what_still_runs_beside_it() -> None:
    """A command stays on the screen until its end, and a new one is seen at once."""
    move = Followed("MOVE")
    move.sees(told("OPERATOR_LEADS"))
    for number in range(5):
        refused = move.log.begin("HOME", "Home", "operator 1", "14:03:23", 1.0 + number)
        move.log.answered(refused, Answer(False, "HOME: no"), 1.1 + number)
    assert [command.kind for command in move.log.shown] == ["HOME", "MOVE"]
    assert move.log.shown[0].number == refused
