"""What `main.py deviation` does: a scan's points against a nominal part, told and written."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from analysis.deviation import FAR, FAR_OFF
from analysis.measures import ruled
from analysis.report.gauge_table import PLAIN
from analysis.report.units import counted, micrometres, percent
from studio.runtime.streams import print_json
from studio.scan.deviation import MEANING, Question, compared, write_deviation

ANOTHER_SIZE = 2.0
"""Times as large or as small as the part: a nominal of the same part is not, in its own unit."""
SIDES = {"above": "outside (above the upper limit)", "below": "inside (below the lower limit)"}
"""What is proved out of the tolerance, by its side of the nominal."""
MARKS = {"pass": "PASS", "fail": "FAIL", "undecided": "UNDECIDED"}


def tell_deviation(folder: Path, **options: Any) -> None:
    """Options as of the command: mm and um. InputError: as `compared` and `write_deviation`."""
    cad = options["cad"]
    question = Question(
        part=options["part"],
        cad=cad,
        cad_unit=options["unit"],
        alignment=options["align"],
        datums=[(1e-3 * x, 1e-3 * y, 1e-3 * z) for x, y, z in options["spots"]],
        datum_radius=1e-3 * options["spot_radius"],
        lower=_metres(options["lower"]),
        upper=_metres(options["upper"]),
    )
    found = compared(folder, question)
    out = options["out"] or folder / "deviation.csv"
    files = write_deviation(found, out, [folder / "points.ply", *([cad] if cad is not None else [])])
    record = found.record
    if options["as_json"]:
        print_json({"ok": True, "files": [str(file) for file in files], **record})
        return
    print(f"{files[0]}: {record['points']} points against {record['nominal']}, {sentence(record).translate(PLAIN)}")
    if options["quiet"]:
        return
    for text in details(record):
        print(text.translate(PLAIN))


def asked(record: dict[str, Any]) -> str:
    """What the figures are of: part, nominal, alignment and the tolerance's band."""
    lower, upper = record["lower"], record["upper"]
    ends = ["none" if end is None else f"{1e6 * end:+.6g}" for end in (lower, upper)]
    band = "no tolerance" if lower is None and upper is None else f"tolerance {' / '.join(ends)} µm"
    aligned = "as measured" if record["alignment"] == "none" else f"aligned by {record['alignment']}"
    return f"{record['part'] or 'All objects'} against {record['nominal']}, {aligned}, {band}"


def sentence(record: dict[str, Any]) -> str:
    """The deviations in one line."""
    spread = f"robust sigma {micrometres(record['robust_sigma'])}, 95 % within {micrometres(record['p95'])}"
    return f"median {micrometres(record['median'])}, {spread}{_ruling(record)}"


def _ruling(record: dict[str, Any]) -> str:
    """How many points make the rms, where it is far beyond what most deviate by; empty: it is of all of them."""
    far = round(record["share_false"] * record["points"])
    if not far or not ruled(record["rms"], record["median"], record["robust_sigma"]):
        return ""
    farther = f"farther than {micrometres(FAR * record['robust_sigma'])} from the median"
    return f"; rms {micrometres(record['rms'])}, ruled by {counted(far, 'point')} {farther}"


def details(record: dict[str, Any]) -> list[str]:
    """How it was aligned, and what the tolerance says."""
    size = f"Mean {micrometres(record['mean'])}, rms {micrometres(record['rms'])}"
    told = [f"{size}, {micrometres(record['least'])} to {micrometres(record['largest'])}"]
    told.append(f"Sign of a deviation: {MEANING}")
    times, unit = record["nominal_over_part"], record["nominal_unit"]
    if not 1.0 / ANOTHER_SIZE < times < ANOTHER_SIZE:
        doubt = f"; it was read in {unit}, and may be in another unit" if unit else ""
        told.insert(0, f"The nominal is {times:.3g} times as large as the part{doubt}")
    if record["share_false"]:
        rest = micrometres(record["rms_without_false"])
        far = f"{percent(record['share_false'], 2)} of the points are {FAR_OFF}"
        told.append(f"{far}; rms {rest} without them")
    if record["alignment"] != "none":
        shift = ", ".join(f"{round(1e3 * value, 4) + 0.0:+.4f}" for value in record["shift"])
        turn = math.degrees(record["turn"])
        held = f"{record['freedoms_held']} of 6 freedoms, {record['points_used']} points"
        told.append(f"Aligned by {record['alignment']} ({held}): shifted by {shift} mm, turned by {turn:.4f} deg")
    counts = record["verdicts"]
    if counts is not None:
        shares = ", ".join(
            f"{counts[name]} {SIDES.get(name, name)}" for name in ("within", "undecided", "above", "below")
        )
        told.append(f"{percent(record['share_beyond'], 2)} of the points are out of the tolerance's band")
        told.append(f"{MARKS[record['verdict']]} by ISO 14253-1{_without_far(record)}, within by two sigma: {shares}")
        told.append(_what_is_out(record, record["undecided_but_beyond"]))
    if record["median_sigma"] is not None:
        at_most = " at most" if record["sigma_is_bound"] else ""
        size = f"{micrometres(2.0 * record['median_sigma'])}{at_most}"
        told.append(f"Uncertainty of a point, two sigma: {size} along the normal, median of {record['points']} points")
    if record["points_left_out"]:
        told.append(f"{record['points_left_out']} points are of other objects")
    return told


def _without_far(record: dict[str, Any]) -> str:
    """The verdict of the others, where those that are far off decide; empty: they do not."""
    without, far = record["verdict_without_far"], round(record["share_false"] * record["points"])
    if without == record["verdict"]:
        return ""
    return f" ({MARKS[without]} without the {counted(far, 'point')} far off)"


def _what_is_out(record: dict[str, Any], alone: int) -> str:
    """The rule for what is outside or inside, and how many points come to less than it."""
    surely, points = record["coverage_beyond"], record["points"]
    told = (
        f"A place is outside or inside where a point is beyond by {surely:.1f} sigma (as rare by chance among {points} "
        "points as two sigma of one), most of those around it are beyond too, and no edge is beside it"
    )
    if not alone:
        return told
    are = "is" if alone == 1 else "are"
    return f"{told}; {alone} of the undecided {are} beyond by two sigma, but not by this"


def _metres(micrometre: float | None) -> float | None:
    return None if micrometre is None else 1e-6 * micrometre
