"""A verdict as lines for people."""

from __future__ import annotations

from what_if.verdict import Outcome, Verdict


def lines_of(verdict: Verdict) -> list[str]:
    """Return the verdict in words: the sentence, further reasons, the figures."""
    found = [verdict.sentence]
    for reason in verdict.reasons[1:4]:
        where = f", {reason.step}" if reason.step else ""
        found.append(f"  also: {reason.time_s:.2f} s{where}: {reason.text}")
    if len(verdict.reasons) > 4:
        found.append(f"  and {len(verdict.reasons) - 4} more")
    first = verdict.reasons[0] if verdict.reasons else None
    if first is not None and first.place_mm is not None:
        found.append("place      ({:.0f}, {:.0f}, {:.0f}) mm".format(*first.place_mm))
    if not verdict.joints:
        return found
    found.append(f"time       {verdict.duration_s:.2f} s ± {verdict.duration_spread_s:.2f} s")
    near = verdict.clearance
    if near is not None:
        one, other = near.between
        found.append(
            f"clearance  {near.distance_mm:.1f} mm between {one} and {other} "
            f"at {near.time_s:.2f} s; nowhere below {near.at_least_mm:.1f} mm"
        )
    found.append("joint         speed  acceleration  effort   (percent of robot.yaml)")
    found += [
        f"{use.joint:<12} {use.speed_percent:6.0f}  {use.acceleration_percent:12.0f}  "
        f"{use.effort_percent:6.0f}"
        for use in verdict.joints
    ]
    found.append(f"speed      {verdict.tool_speed_mm_s:.0f} mm/s, the {verdict.fastest_point}")
    found.append(f"zones      {', '.join(verdict.zones) or 'none touched'}")
    found.append(f"parts      {len(verdict.placed)} placed, {len(verdict.dropped)} dropped")
    found += [f"           {text}" for text in verdict.placed]
    found += [f"           dropped: {name}" for name in verdict.dropped]
    found.append(f"energy     {verdict.energy_j:.0f} J")
    return found


def caption_of(verdict: Verdict) -> list[str]:
    """Return what stands below a picture of the worst moment."""
    near = verdict.clearance
    if verdict.outcome is Outcome.REFUSED or near is None:
        return [verdict.sentence]
    one, other = near.between
    nearest = f"Nearest at {near.time_s:.2f} s: {near.distance_mm:.1f} mm between {one} and {other}"
    return [verdict.sentence, nearest]
