"""What is measured of a part: a dimension by its name, the parts of the profile that it is made of, its tolerance."""

from __future__ import annotations

import math
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from render.base.model import Model, quantity

Kind = Literal[
    "step",
    "width",
    "angle",
    "opening",
    "radius",
    "v_depth",
    "peak",
    "straightness",
    "flatness",
    "point_to_point",
    "thickness",
    "gap",
    "edge_to_edge",
    "flush",
    "area",
]
Verdict = Literal["pass", "fail", "undecided"]
LEFT_OUT = "are left out"
"""What remarks hold that tell how many points of a region a curve leaves out, as over an edge."""
MISSES = "points miss "
"""How remarks begin that the points are not of the fitted curve, with what else is told before them."""
REGIONS: dict[Kind, tuple[str, ...]] = {
    "step": ("lower side", "upper side"),
    "width": ("reference", "left flank", "right flank"),
    "angle": ("first line", "second line"),
    "opening": ("left side", "right side"),
    "radius": ("arc",),
    "v_depth": ("reference", "left flank", "right flank"),
    "peak": ("reference", "peak"),
    "straightness": ("line",),
    "flatness": ("surface",),
    "point_to_point": ("first point", "second point"),
    "thickness": ("datum", "surface"),
    "gap": ("left edge", "right edge"),
    "edge_to_edge": ("first edge", "second edge"),
    "flush": ("first sheet", "second sheet"),
    "area": ("reference", "section"),
}
"""Kind -> what each of its regions is."""
TITLES: dict[Kind, str] = {
    "step": "Step height",
    "width": "Width",
    "angle": "Angle (by which the line turns)",
    "opening": "Opening angle (of a V or an edge)",
    "radius": "Radius",
    "v_depth": "V depth",
    "peak": "Peak height",
    "straightness": "Straightness (bow)",
    "flatness": "Flatness (bow and twist)",
    "point_to_point": "Point to point",
    "thickness": "Thickness",
    "gap": "Gap",
    "edge_to_edge": "Edge to edge (of a hole, slot or plate)",
    "flush": "Flush",
    "area": "Area",
}
KINDS_OF_SCAN: tuple[Kind, ...] = ("flatness",)
"""Read off all steps of a scan together."""
NEVER_NEGATIVE = ("width", "opening", "radius", "flatness", "point_to_point", "edge_to_edge")
"""Kinds whose lower limit of 0, as drawings have it, is kept by every part, however uncertain the value is."""
MOST_GAUGES = 64
Place = Annotated[float, Field(ge=-100.0, le=100.0)]
Region = tuple[Place, Place]


class Gauge(Model):
    """A measure of the part. Its sizes are m, an angle's rad, an area's m^2, nominal and tolerance too."""

    name: str = quantity("measure", label="Name", min_length=1, max_length=80)
    kind: Kind = quantity("step", label="Kind", help="What is measured.")
    laser: int = quantity(0, label="Laser", help="In whose profile: 0 is the rig's first.", ge=0, le=63)
    step: int | None = quantity(None, label="Step", help="Of the motion; empty: every one.", ge=0, le=1_000_000)
    regions: tuple[Region, ...] = quantity(
        unit="m", label="Regions", help="From and to across the fan, as the profile's plot has it.", max_length=3
    )
    nominal: float | None = quantity(None, unit="m", label="Nominal", help="What the drawing has.", ge=-100, le=100)
    lower: float | None = quantity(
        None,
        unit="m",
        label="Lower tolerance",
        help="Deviation from the nominal, below it with a minus sign.",
        ge=-100,
        le=100,
    )
    upper: float | None = quantity(
        None,
        unit="m",
        label="Upper tolerance",
        help="Deviation from the nominal, below it with a minus sign.",
        ge=-100,
        le=100,
    )

    @model_validator(mode="after")
    def _is_whole(self) -> Self:
        wanted = REGIONS[self.kind]
        if len(self.regions) != len(wanted):
            raise ValueError(
                f"regions: {len(self.regions)} of them; allowed for {self.kind}: {len(wanted)} ({', '.join(wanted)})"
            )
        if self.of_scan and self.step is not None:
            raise ValueError(f"step is {self.step}; allowed for {self.kind}, which is of all steps: none")
        for i, (low, high) in enumerate(self.regions):
            if not high > low:
                raise ValueError(f"regions[{i}] goes from {low} m to {high} m; allowed: the second is the larger")
        if self.nominal is None and (self.lower is not None or self.upper is not None):
            raise ValueError("lower and upper are deviations from nominal, which is missing; give it, or none of them")
        if self.lower is not None and self.upper is not None and self.lower > self.upper:
            factor, unit = {"m": (1e3, "mm"), "rad": (180.0 / math.pi, "deg"), "m2": (1e6, "mm²")}[self.unit]
            found = f"lower is {factor * self.lower:.6g} {unit} and upper {factor * self.upper:.6g} {unit}"
            raise ValueError(
                f"{found}; allowed: lower is not above upper, with a minus sign if it is below the nominal"
            )
        return self

    @property
    def of_scan(self) -> bool:
        """It is read off all steps together, not off each."""
        return self.kind in KINDS_OF_SCAN

    @property
    def unit(self) -> Literal["m", "rad", "m2"]:
        """Of the value."""
        return "rad" if self.kind in ("angle", "opening") else "m2" if self.kind == "area" else "m"

    @property
    def limits(self) -> tuple[float, float]:
        """Of the value, infinite where there is none; of what is never negative a lower one of 0 is none."""
        if self.nominal is None:
            return -math.inf, math.inf
        low = -math.inf if self.lower is None else self.nominal + self.lower
        high = math.inf if self.upper is None else self.nominal + self.upper
        return -math.inf if self.kind in NEVER_NEGATIVE and low <= 0.0 else low, high

    def reads_as(self, other: Gauge) -> bool:
        """Both have the same value in the same profile, whatever their names and tolerances are."""
        judged = {"name": self.name, "nominal": None, "lower": None, "upper": None}
        return self.model_copy(update=judged) == other.model_copy(update=judged)

    def verdict(self, value: float, sigma: float, remark: str = "") -> Verdict | None:
        """ISO 14253-1 with U = 2 sigma: proved within, proved outside, or neither; None: no tolerance, or no value.

        remark: of the reading; where its points miss the curve, its sigma does not hold the error and proves nothing.
        """
        if self.nominal is None or (self.lower is None and self.upper is None) or not math.isfinite(value + sigma):
            return None
        if MISSES in remark:
            return "undecided"
        low, high = self.limits
        uncertainty = 2.0 * sigma
        if value - uncertainty >= low and value + uncertainty <= high:
            return "pass"
        return "fail" if value + uncertainty < low or value - uncertainty > high else "undecided"
