"""A line between two network namespaces that delays packets and loses some.

Usage: ``python slow_line.py FIRST_NAMESPACE SECOND_NAMESPACE DEVICE DELAY_MS LOSS_PERCENT SEED``
makes the TUN interface DEVICE in both, prints ``ready``, and carries packets until it is ended.
The kernel's netem would do the same, but not every kernel has it. Source: the kernel's
networking/tuntap, setns(2).
"""

from __future__ import annotations

import ctypes
import fcntl
import heapq
import os
import select
import struct
import sys
import time
from itertools import count
from random import Random

TUNSETIFF, IFF_TUN, IFF_NO_PI, CLONE_NEWNET = 0x400454CA, 0x0001, 0x1000, 0x40000000
LARGEST = 65_536
LIBC = ctypes.CDLL(None, use_errno=True)


def opened(namespace: str, device: str) -> int:
    """Return a new TUN interface of a namespace; this process is in that namespace from now on."""
    place = os.open(f"/var/run/netns/{namespace}", os.O_RDONLY)
    if LIBC.setns(place, CLONE_NEWNET):
        raise OSError(ctypes.get_errno(), f"setns {namespace}")
    os.close(place)
    tun = os.open("/dev/net/tun", os.O_RDWR | os.O_NONBLOCK)
    fcntl.ioctl(tun, TUNSETIFF, struct.pack("16sH14x", device.encode(), IFF_TUN | IFF_NO_PI))
    return tun


def carry(ends: tuple[int, int], delay_s: float, loss: float, chance: Random) -> None:
    """Carry packets both ways for ever; what comes while the other end is down is lost."""
    waiting: list[tuple[float, int, int, bytes]] = []
    number = count()
    other = {ends[0]: ends[1], ends[1]: ends[0]}
    while True:
        left = max(0.0, waiting[0][0] - time.monotonic()) if waiting else None
        readable, _, _ = select.select(ends, (), (), left)
        now = time.monotonic()
        for end in readable:
            packet = os.read(end, LARGEST)
            if chance.random() >= loss:
                heapq.heappush(waiting, (now + delay_s, next(number), other[end], packet))
        while waiting and waiting[0][0] <= now:
            _, _, end, packet = heapq.heappop(waiting)
            try:
                os.write(end, packet)
            except OSError:
                continue  # that end is down: the line is cut


def main(words: list[str]) -> None:
    """Carry packets until the process is ended."""
    first, second, device, delay_ms, loss_percent, seed = words
    ends = opened(first, device), opened(second, device)
    print("ready", flush=True)
    carry(ends, float(delay_ms) * 1e-3, float(loss_percent) * 1e-2, Random(int(seed)))


if __name__ == "__main__":
    main(sys.argv[1:])
