"""The farm's figures: views over the history and questions to them, in SQL of DuckDB; pure.

Key figures are those of ISO 22400-2. A cell's journal knows cycles, stops and starts. What needs
more (a shift calendar, a planned time of each item, who judged a part) is not known to it: a figure
that needs it is NULL, never guessed. How each is counted: docs/farm/figures.md. Values of a
question are named ``$begin``; times are [s since 1970].
"""

from __future__ import annotations

import msgspec

DONE = "done"
"""Outcome of a cycle that ended as meant, as the cell's journal writes it."""
BEFORE_S = 7 * 86400.0
"""Our choice: what began so long before the time looked at still counts for how a cell was then."""
DRIFTING = {"following error [mm]": "worst_error_mm", "lag of the robot [s]": "follower_lag_s"}
"""What drifts, and its key in a cycle's entry; each program for itself."""
RATES = {
    "cycles done [1/h]": "1.0",
    "parts placed [1/h]": "placed",
    "parts dropped [1/h]": "dropped",
}
"""What is counted in an hour."""

LEAST_PAST = 4
"""Our choice: spans before the newest ones, else nothing is said of a drift."""
LEAST_CELLS = 5
"""Our choice: with fewer cells nobody can tell what moves all of them."""
DRIFT_LIMIT = 6.0
"""Our choice: so many times the noise; among 1,000 figures at rest none comes near it."""
DRIFT_SHARE = 0.05
"""Our choice: a figure that has changed by less than 5 % is no matter for anybody."""
FLOOR = 0.005
"""Our choice: noise is not taken as less than this share of the figure."""
MAD_TO_SIGMA = 1.4826
"""Median distance to standard deviation, of a normal distribution."""

LIMIT = 2.0
"""Our choice: two sides differ by so many times the scatter of both together."""
LEAST_SHARE = 0.02
"""Our choice: what differs by less than 2 % is no matter for anybody."""
LEAST_SPANS = 3
"""Our choice: with fewer nobody can tell the scatter, and nothing is marked."""
DAY_S, SPANS = 86400.0, 8
"""Our choice: spans are days, or an eighth of a time that is shorter than half of eight days."""

_FIGURES = {**DRIFTING, "cycle time [s]": "seconds", **RATES}
_COLUMNS = ", ".join(f"CAST({column} AS DOUBLE) AS '{name}'" for name, column in _FIGURES.items())
VIEWS = (
    "CREATE MACRO moment(seconds) AS make_timestamp(CAST(floor(seconds * 1e6) AS BIGINT))",
    # How much of a time lies within another.
    "CREATE MACRO inside(first, last, begin, until) AS "
    "greatest(0.0, least(last, until) - greatest(first, begin))",
    "CREATE MACRO share(part, whole) AS CASE WHEN whole > 0 THEN part / whole END",
    "CREATE MACRO total(value) AS coalesce(sum(value), 0)",
    # The cause of an event; where its kind says it all, that.
    """CREATE VIEW caused AS
SELECT *, machine || '/' || cell AS name, epoch(time) AS unix, coalesce(
  CASE kind WHEN 'decision' THEN body->>'event' WHEN 'alarm' THEN body->>'text'
  WHEN 'cycle' THEN body->>'outcome' END, kind) AS cause
FROM events""",
    # What is no number is not known: one odd entry must not refuse the figures of all cells. A
    # cycle without both times is none: greatest() and least() would take the time looked at.
    """CREATE VIEW cycles AS
SELECT name, machine, cell, time, unix, cause AS outcome,
  coalesce(body->>'program', '') AS program, body->>'leader' AS leader,
  TRY_CAST(body->>'start' AS DOUBLE) AS began, TRY_CAST(body->>'end' AS DOUBLE) AS ended,
  coalesce(TRY_CAST(body->>'paused_s' AS DOUBLE), 0) AS paused_s,
  ended - began - paused_s AS seconds,
  TRY_CAST(body->>'worst_error_mm' AS DOUBLE) AS worst_error_mm,
  TRY_CAST(body->>'follower_lag_s' AS DOUBLE) AS follower_lag_s,
  coalesce(TRY_CAST(body->>'parts_placed' AS INTEGER), 0) AS placed,
  coalesce(TRY_CAST(body->>'parts_dropped' AS INTEGER), 0) AS dropped
FROM caused WHERE kind = 'cycle' AND began IS NOT NULL AND ended IS NOT NULL""",
    # A row for each figure of each cycle that ended as meant; what is not known has none.
    f"""CREATE VIEW cycle_figures AS
SELECT name, time, unix, program, quantity, quantity LIKE '%[1/h]' AS rate, value,
  CASE WHEN rate THEN quantity ELSE trim(quantity || ' ' || program) END AS figure
FROM (SELECT name, time, unix, program, {_COLUMNS} FROM cycles WHERE outcome = '{DONE}')
UNPIVOT (value FOR quantity IN (COLUMNS(* EXCLUDE (name, time, unix, program))))""",
)
"""What stands beside the table ``events``."""


class StopCause(msgspec.Struct, frozen=True):
    """What stopped pairs, how often, in how many cells, and the last of them; times since 1970."""

    cause: str
    times: int
    cells: int
    first: float
    last: float
    last_in: str
    last_text: str


class KeyFigures(msgspec.Struct, frozen=True):
    """Figures of one cell, or of all; a share is 0 to 1, None: it is not known.

    Attributes:
        cell: MACHINE/CELL, or empty: all.
        busy_s: Planned busy time: the time looked at, without what the cell was off.
        production_s: Actual production time: cycles, without their pauses.
        stopped_s: Time in which the pair did not go on by itself.
        off_s: Time without a running journal.
        availability: production_s / busy_s.
        effectiveness: Planned run time of what was made / production time of those programs
            (performance).
        quality_ratio: Good parts / parts.
        oee: Product of the three.
        cycles: Cycles that ended, whoever led.
        done: Those that ended as meant: ``programs`` of the real robot, ``twin_moves`` and
            ``operator_moves``.
        programs, twin_moves, operator_moves: See above.
        cycle_s: Median of the programs among them.
        parts: Placed and dropped.
        stops: All; ``failures``: those that nobody asked for.
        failures: See above.
        mean_between_failures_s: production_s / failures.
        mean_restoration_s: Mean time from a failure until the pair went on.
    """

    cell: str
    busy_s: float
    production_s: float
    stopped_s: float
    off_s: float
    availability: float | None
    effectiveness: float | None
    quality_ratio: float | None
    oee: float | None
    cycles: int
    done: int
    programs: int
    twin_moves: int
    operator_moves: int
    cycle_s: float | None
    parts: int
    stops: int
    failures: int
    mean_between_failures_s: float | None
    mean_restoration_s: float | None


# $planned and $planned_s: programs with a planned run time, and these times [s].
KEY_FIGURES = f"""
WITH told AS ( -- Off is from the last entry of any kind. What a journal has found in its files at
  -- its start, it tells before it: that is no sign that it ran.
  SELECT name, kind, unix, row_number() OVER row AS n, min_by(unix, (era, number)) OVER cell
    AS since, max(CASE WHEN kind NOT IN ('gap', 'torn') THEN unix END)
      OVER (row ROWS BETWEEN UNBOUNDED PRECEDING AND 1 PRECEDING) AS last,
    kind = 'decision' AND stop AS stops, coalesce(body->>'who', '') = '' AS unasked,
    kind = 'start' OR kind = 'decision' AND NOT stop
      AND coalesce(body->>'mode_before' <> body->>'mode_after'
        -- Into STOPPED without a stop (RESET) is a step on the way out: the pair stands.
        AND body->>'mode_after' <> 'STOPPED', false) AS goes_on
  FROM (SELECT name, kind, unix, era, number, stop,
      CASE WHEN kind = 'decision' THEN body END AS body FROM caused
    WHERE time >= moment($begin - {BEFORE_S}) AND time < moment($until))
  WINDOW cell AS (PARTITION BY name), row AS (PARTITION BY name ORDER BY era, number)
  QUALIFY kind IN ('decision', 'cycle', 'start')
), cells AS (
  SELECT name, greatest($begin, min(since)) AS begin FROM told GROUP BY name
), -- A run begins where a pair goes on. Whether it was stopped while it was off nobody knows.
runs AS (
  SELECT name, min_by(unix, n) FILTER (stops) AS down, min_by(unix, n) FILTER (stops AND unasked)
    AS failed, lead(min(CASE WHEN kind = 'start' THEN coalesce(last, unix) ELSE unix END)
    FILTER (goes_on)) OVER (PARTITION BY name ORDER BY run) AS went_on
  FROM (SELECT *, count(*) FILTER (goes_on) OVER
        (PARTITION BY name ORDER BY n ROWS UNBOUNDED PRECEDING) AS run FROM told)
  GROUP BY name, run
), counted AS (
  SELECT name, greatest(0.0, $until - begin) AS looked_at FROM cells
  UNION ALL BY NAME
  SELECT name, CASE WHEN kind = 'start' THEN inside(last, unix, begin, $until) END AS off,
    stops AND unix BETWEEN begin AND $until AS pair_stop, pair_stop AND unasked AS failure
  FROM told JOIN cells USING (name)
  UNION ALL BY NAME
  SELECT name, inside(down, coalesce(went_on, $until), begin, $until) AS stopped,
    CASE WHEN went_on IS NOT NULL AND failed BETWEEN begin AND $until
      THEN greatest(0.0, went_on - failed) END AS restoration
  FROM runs JOIN cells USING (name) WHERE down IS NOT NULL
  UNION ALL BY NAME
  SELECT name, greatest(0.0, inside(began, ended, begin, $until) - paused_s) AS production,
    ended BETWEEN begin AND $until AS cycle, cycle AND outcome = '{DONE}' AS done,
    done AND leader = 'real' AS ran, done AND leader = 'twin' AS twin_move,
    done AND leader = 'operator' AS operator_move, CASE WHEN ran THEN seconds END AS cycle_s,
    CASE WHEN cycle THEN placed END AS placed, CASE WHEN cycle THEN dropped END AS dropped,
    CASE WHEN cycle AND leader = 'real' THEN map(CAST($planned AS VARCHAR[]),
      CAST($planned_s AS DOUBLE[]))[program] END AS plan,
    -- What was begun and not ended as meant has cost time and made nothing.
    CASE WHEN done THEN plan END AS planned,
    CASE WHEN plan IS NOT NULL THEN seconds END AS planned_production
  FROM cycles JOIN cells USING (name)
  WHERE time >= moment($begin - {BEFORE_S}) AND time < moment($until)
)
SELECT coalesce(name, '') AS cell, total(looked_at) - total(off) AS busy_s,
  total(production) AS production_s, total(stopped) AS stopped_s, total(off) AS off_s,
  share(production_s, busy_s) AS availability,
  share(total(planned), total(planned_production)) AS effectiveness,
  share(total(placed), total(placed) + total(dropped)) AS quality_ratio,
  availability * effectiveness * quality_ratio AS oee, count(*) FILTER (cycle) AS cycles,
  count(*) FILTER (ran OR twin_move OR operator_move) AS done, count(*) FILTER (ran) AS programs,
  count(*) FILTER (twin_move) AS twin_moves, count(*) FILTER (operator_move) AS operator_moves,
  median(cycle_s) AS cycle_s, total(placed) + total(dropped) AS parts,
  count(*) FILTER (pair_stop) AS stops, count(*) FILTER (failure) AS failures,
  share(production_s, failures) AS mean_between_failures_s,
  avg(restoration) AS mean_restoration_s
FROM counted GROUP BY GROUPING SETS ((name), ()) HAVING busy_s > 0
ORDER BY name IS NULL, coalesce(availability, 0), name
"""
"""Of each cell, the least available first, and of all cells last: :class:`KeyFigures`."""


class FigureDrift(msgspec.Struct, frozen=True):
    """A figure of a cell against its own past.

    Attributes:
        cell: MACHINE/CELL.
        figure: Which figure, with its unit.
        before: Its median at the beginning.
        now: Its median in the newest spans.
        score: Change, without what all cells have changed, in multiples of the noise.
        drifts: Whether the cell goes away from its own past.
        values: Of all spans, in their order.
    """

    cell: str
    figure: str
    before: float
    now: float
    score: float
    drifts: bool
    values: tuple[float, ...]


# A figure is taken as the median of each span of time (a day). The two newest spans are compared
# with the first half of those before them, so that a slow drift does not become its own past. The
# noise is what differs from span to span; a slow drift adds little to it. What moves all cells
# alike (summer) is taken off where there are enough cells to tell.
MEDIANS = f"""
  SELECT name AS cell, figure, CAST(floor(unix / $span_s) AS BIGINT) AS place,
    median(value) AS value
  FROM cycle_figures WHERE quantity IN {tuple(DRIFTING)}
    AND time >= moment($begin) AND time < moment($until) GROUP BY ALL
"""
"""A value for each cell, figure and span."""
DRIFTS = f"""
WITH medians AS ({MEDIANS}), rows AS (
  SELECT cell, figure, list(value ORDER BY place) AS values, values[:-3] AS past
  FROM medians GROUP BY cell, figure
), changes AS (
  SELECT *, list_median(past[:(len(past) + 1) // 2]) AS before, list_median(values[-2:]) AS now,
    list_transform(list_zip(values[2:], values[:-2]), lambda pair: abs(pair[1] - pair[2])) AS steps,
    greatest({MAD_TO_SIGMA} * list_median(steps) / sqrt(2), {FLOOR} * before) AS noise,
    (now - before) / before AS share
  FROM rows WHERE len(past) >= {LEAST_PAST} AND before > 0
), own AS (
  SELECT *, share - CASE WHEN count(*) OVER figure >= {LEAST_CELLS}
    THEN median(share) OVER figure ELSE 0 END AS own
  FROM changes WINDOW figure AS (PARTITION BY figure)
)
SELECT cell, figure, before, now, own * before / noise AS score,
  abs(score) > {DRIFT_LIMIT} AND abs(own) > {DRIFT_SHARE} AS drifts, values
FROM own ORDER BY NOT drifts, abs(score) DESC, cell, figure
"""
"""All figures that can be compared, those that changed most first: :class:`FigureDrift`."""


class Difference(msgspec.Struct, frozen=True):
    """One figure of both sides.

    Attributes:
        figure: Which, with its unit.
        a, b: Its value; None: it is not known there.
        scatter: Of both together, in the figure's unit; None: there are too few spans.
        differs: Whether the difference is larger than the scatter explains.
    """

    figure: str
    a: float | None
    b: float | None
    scatter: float | None
    differs: bool


# Each figure is taken over the whole time, and in each span of it. What the spans differ from each
# other is the figure's own scatter. $names, $begins, $ends: MACHINE/CELL and time of both sides.
COMPARISON = f"""
WITH sides AS (
  SELECT *, greatest(until - begin, 1e-9) AS whole, CASE WHEN whole >= {SPANS / 2 * DAY_S}
    THEN round_even(whole / {DAY_S}, 0) ELSE {SPANS} END AS spans, whole / spans AS length
  FROM (SELECT unnest(['a', 'b']) AS side, unnest($names) AS name,
    unnest(CAST($begins AS DOUBLE[])) AS begin, unnest(CAST($ends AS DOUBLE[])) AS until)
), told AS (
  SELECT name, time, unix, figure, rate, value, CASE WHEN NOT rate THEN '2 ' || program
    WHEN quantity LIKE 'cycles%' THEN '1' ELSE '3' END AS rank
  FROM cycle_figures
  UNION ALL
  SELECT name, time, unix, 'stops: ' || cause || ' [1/h]', true, 1.0, '4' FROM caused WHERE stop
), happened AS (
  SELECT side, figure, rate, value, rank,
    CAST(least(spans - 1, floor((unix - begin) / length)) AS BIGINT) AS place
  FROM told JOIN sides USING (name)
  WHERE unix >= begin AND unix < until AND list_contains($names, name)
    AND time >= moment(list_min($begins)) AND time < moment(list_max($ends))
), places AS (
  SELECT *, unnest(range(CAST(spans AS BIGINT))) AS place FROM sides
), names AS (
  SELECT DISTINCT figure, rank FROM happened WHERE rate
  UNION SELECT unnest({list(RATES)}), unnest(['1', '3', '3'])
), spans AS ( -- With the whole time, whose place is NULL.
  SELECT side, figure, rank, place, 3600 * total(value)
    / CASE WHEN place IS NULL THEN any_value(whole) ELSE any_value(length) END AS value
  FROM places CROSS JOIN names LEFT JOIN happened USING (side, figure, rank, place)
  GROUP BY GROUPING SETS ((side, figure, rank, place), (side, figure, rank))
  UNION ALL
  SELECT side, figure, rank, place, median(value) FROM happened WHERE NOT rate
  GROUP BY GROUPING SETS ((side, figure, rank, place), (side, figure, rank))
), values AS (
  SELECT side, figure, rank, max(value) FILTER (place IS NULL) AS value,
    var_samp(value) FILTER (place IS NOT NULL) AS variance, count(place) AS spans
  FROM spans GROUP BY side, figure, rank
)
SELECT figure, a.value AS a, b.value AS b, CASE WHEN a.spans >= {LEAST_SPANS}
    AND b.spans >= {LEAST_SPANS} THEN sqrt(a.variance + b.variance) END AS scatter,
  abs(a.value - b.value) AS apart, coalesce(apart > {LIMIT} * scatter
    AND apart > {LEAST_SHARE} * greatest(abs(a.value), abs(b.value)), false) AS differs
FROM (FROM values WHERE side = 'a') AS a FULL JOIN (FROM values WHERE side = 'b') AS b
  USING (figure, rank)
ORDER BY NOT differs, rank, figure
"""
"""All figures that one of both sides has, those that differ first: :class:`Difference`."""
