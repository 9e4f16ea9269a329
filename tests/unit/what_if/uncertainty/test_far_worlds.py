"""Drawn worlds that the lab's workers judge are those that are judged here."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import pytest
from distributed import LocalCluster
from harness.processes import free_port
from harness.yaml_files import CONFIG
from what_if.cell_files_io import find_program
from what_if.errors import WhatIfError
from what_if.motions import JointTarget, ProgramRun
from what_if.uncertainty import far_worlds_io as far_worlds
from what_if.uncertainty.many_worlds_io import LOT, chances
from what_if.world import World

TURN = JointTarget((0.4, -0.3, -0.1, 0.2))
NO_PAGE = "127.0.0.1:0"


@contextmanager
def scheduler(workers: int) -> Iterator[str]:
    """Give the address of a scheduler whose workers are threads of this process."""
    with LocalCluster(
        n_workers=workers,
        threads_per_worker=2,
        processes=False,
        protocol="tcp",
        host="127.0.0.1",
        dashboard_address=NO_PAGE,
        worker_dashboard_address=NO_PAGE,
        memory_limit=0,
    ) as cluster:
        yield cluster.scheduler_address


def test_workers_of_a_scheduler_give_the_same_chances(world: World) -> None:
    """One question after the other; their threads share one engine."""
    article = ProgramRun(find_program(world.cell, "ARTICLE", CONFIG))
    told: list[int] = []
    with scheduler(1) as address:
        for motion, count in ((article, 5), (TURN, 2 * LOT + 1)):
            here = chances(world, motion, count, 3, 1, CONFIG)
            there = chances(world, motion, count, 3, 0, CONFIG, told.append, address)
            assert there == here
            assert told[-1] == count


def test_scheduler_without_workers_is_told_with_what_to_do(world: World) -> None:
    """Nobody would ever answer."""
    with (
        scheduler(0) as address,
        pytest.raises(WhatIfError, match=r"no workers: \./cell lab worker"),
    ):
        chances(world, TURN, 5, 0, directory=CONFIG, scheduler=address)


@pytest.mark.parametrize(
    ("address", "why"),
    [
        ("10.1.2.3:8786", "of this machine only"),
        ("somewhere:8786", "of this machine only"),
        ("127.0.0.1", "allowed is 127.0.0.1:PORT"),
        ("127.0.0.1:{free}", "no scheduler answers at"),
    ],
)
def test_wrong_address_is_told(
    world: World, monkeypatch: pytest.MonkeyPatch, address: str, why: str
) -> None:
    """Another machine, none at all, and nobody there."""
    monkeypatch.setattr(far_worlds, "CONNECT_S", 0.5)
    asked = address.format(free=free_port())
    with pytest.raises(WhatIfError, match=why):
        chances(world, TURN, 5, 0, directory=CONFIG, scheduler=asked)
