"""The result of a run as a table on the terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from twin_experiments.palletising import SUMMARY
from twin_experiments.palletising import summary_rows as summary_of_parts
from twin_experiments.report.document import HEADINGS, paper_rows, report_document, summary_rows
from twin_experiments.report.label.notes import pause_note
from twin_experiments.report.label.plant import plant_label
from twin_experiments.report.label.verdict import run_verdict
from twin_experiments.report.repeats import HEADINGS as REPEAT_HEADINGS
from twin_experiments.report.repeats import repeat_rows

if TYPE_CHECKING:
    from twin_experiments.report.report_io import Report  # with all figures, which are slow to load

STYLES = {"pass": "bold green", "FAIL": "bold red"}


def print_report(report: Report, console: Console) -> None:
    """Print one column for each experiment, with this project's and the article's figures.

    Then say why something failed.
    """
    config, reach_mm = report.configuration.experiments, report.configuration.robot.reach_mm
    columns = [
        HEADINGS,
        *summary_rows(report.results, reach_mm),
        *paper_rows(config.limits, config.paper),
    ]
    plant = escape(plant_label(report.made_with.plant))
    table = Table(title=f"real robot and twin, errors in mm and percent of reach\nplant {plant}")
    for column in columns:
        table.add_column(column[0])
    for cells in list(zip(*columns))[1:]:
        table.add_row(*(f"[{STYLES[cell]}]{cell}[/]" if cell in STYLES else cell for cell in cells))
    console.print(table)
    _print_repeats(report, console)
    for result in report.results:
        if result.parts:
            parts = Table(*SUMMARY, title=f"parts of {result.span.label}")
            for row in summary_of_parts(result.parts):
                parts.add_row(*row)
            console.print(parts)
    for result in report.results:
        pauses = [pause_note(result)] if result.pauses else []
        for text in (*result.reasons, *pauses):
            console.print(f"{result.span.label}: {text}", markup=False, soft_wrap=True)
    for text in (*report.foretold, *filter(None, (report.missing,))):
        console.print(text, markup=False, soft_wrap=True)
    document = report_document(report.results, reach_mm, config.paper)
    console.print(run_verdict(document, config.limits), style="bold", markup=False, soft_wrap=True)
    console.print(f"report: {(report.folder / 'report.html').resolve().as_uri()}", soft_wrap=True)


def _print_repeats(report: Report, console: Console) -> None:
    """Print mean, spread and worst of experiments that were made more than once."""
    document = report_document(
        report.results, report.configuration.robot.reach_mm, report.configuration.experiments.paper
    )
    rows = repeat_rows(document.get("repeats", []))
    if rows:
        table = Table(*REPEAT_HEADINGS, title="repeats; percents are of reach")
        for row in rows:
            table.add_row(*row)
        console.print(table)
