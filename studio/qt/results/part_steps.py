"""What the measures of the part came to over the steps of a scan, and of which steps the figures are."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from analysis.gauges.gauge import Gauge
from analysis.gauges.read import Reading
from analysis.report.gauge_table import counts_text, worst_of
from studio.qt.core.session import Session
from studio.qt.results.scan_bar import ScanBar
from studio.scan.gauging import judged_over_steps, step_readings
from studio.scan.scan_results import ScanResults

AGAIN = "Measure > Measure the scan again"
MEASURED_LAST = "as measured last"
LAST = f"{MEASURED_LAST}, by the tolerance of now"


def value_of_worst(entry: Mapping[str, Any], value: str) -> str:
    """The value of an entry as it is shown, with its step where it is one of several."""
    return f"{value} (step {entry['step'] + 1})" if worst_of(entry) else value


class PartSteps:
    """Of the shown scan, as it was measured last and by the tolerances of now: the rows of its report."""

    def __init__(self, session: Session, scan_bar: ScanBar) -> None:
        self._session, self._scan_bar = session, scan_bar
        self._scan: ScanResults | None = None
        self._found: dict[Gauge, list[Reading]] = {}
        self._judged: dict[Gauge, dict[str, Any] | None] = {}

    def entry(self, gauge: Gauge) -> dict[str, Any] | None:
        """As of `measures_record`; None: the steps were not measured like this."""
        render = self._session.shown
        scan = None if render is None else render.scan
        if scan is None or scan.measured_as.measured_in != self._session.project.measured_in:
            return None
        if scan is not self._scan:
            self._scan, self._judged = scan, {}
            self._found = step_readings(scan.found.folder / "measures.csv", scan.measured_as.measures)
        if gauge not in self._judged:
            found = next((found for was, found in self._found.items() if was.reads_as(gauge) and found), None)
            self._judged[gauge] = None if found is None else judged_over_steps(gauge, found)
        return self._judged[gauge]

    def shown(self, gauge: Gauge) -> dict[str, Any] | None:
        """The same while the figures of all steps are asked for; None: this step's are shown."""
        return self.entry(gauge) if self._scan_bar.whole is not None else None

    @property
    def drawn(self) -> str:
        """Of which step the values are that are drawn, while those of the table are of all; else empty."""
        render = self._session.shown
        return "" if render is None or self._scan_bar.whole is None else f"step {render.frame.step + 1}"

    def of_which(self, gauge: Gauge) -> str:
        """Beside a verdict of one step of a scan, or of all that are read together."""
        render = self._session.shown
        if render is None or render.scan is None:
            return ""
        return ", all steps" if gauge.of_scan else f", step {render.frame.step + 1}"

    def told(self, gauge: Gauge | None, kept: bool, gauges: tuple[Gauge, ...]) -> str:
        """Which steps the figures of the chosen measure are of, and what all steps came to; None: of all measures.

        kept: what the scan found of a measure of all steps is shown.
        """
        render = self._session.shown
        if render is None or render.scan is None:
            return ""
        scan, told = render.scan, f"Of step {render.frame.step + 1} of {render.scan.count}."
        if gauge is not None and gauge.of_scan:
            others = " Values of other measures are those of the worst step." if len(gauges) > 1 else ""
            return f"It is of all {scan.count} steps together, as measured last.{others}" if kept else ""
        otherwise = scan.measured_as.measured_in != self._session.project.measured_in
        if otherwise and scan.measured_as.measures:
            return f"{told} All steps were measured in another section: {AGAIN}."
        if gauge is None:
            together = "; flatness of all steps together" if any(one.of_scan for one in gauges) else ""
            if any(self.shown(one) for one in gauges if not one.of_scan):
                return f"Of all {scan.count} steps, {LAST}: values are those of the worst step{together}."
            return f"{told[:-1]}{together}."
        entry = self.entry(gauge)
        if entry is None:
            return f"{told} All steps are not measured like this yet: {AGAIN}." if scan.measured else told
        counts = counts_text(entry["verdicts"])
        last = LAST if gauge.lower is not None or gauge.upper is not None else MEASURED_LAST
        if self._scan_bar.whole is None:
            return f"{told} All steps, {last}: {counts}."
        worst = worst_of(entry)
        return f"Of all {scan.count} steps, {last}: {counts}." + (f" Its value is of the {worst}." if worst else "")
