"""What a render computed, left out and knows, as sentences: the only place that makes any, for all who show them.

Everything here follows from the fields of `render.plan`; nothing reads a sentence again.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

from render.importance import LEAST_SAMPLES, LINES_KNOWN
from render.plan import GroupQuality, Plan, ThinLens, TransportStep, line_noise

LIGHT = {
    ("direct", "direct"): "light of each laser that meets one surface, exact across the sheet, sampled across edges "
    "and shadows",
    ("indirect", "indirect"): "light of the lasers that meets two or more surfaces",
    ("indirect", "interreflection"): "laser light over two or more rough surfaces",
    ("indirect", "caustic"): "laser light through clear glass or off mirrors, connected from the laser or the camera",
    (
        "indirect",
        "specular-chain",
    ): "laser light through clear glass or off mirrors both before and after each rough surface, by walks or merging",
    ("indirect", "subsurface"): "laser light scattered below a surface, by random walk",
    ("ambient", "ambient"): "light of lamps, surroundings and shining objects",
    ("ambient", "interreflection"): "ambient light that meets two or more surfaces (interreflection, light through "
    "glass)",
}
"""Description of each step of a plan, by its group and name."""
NAMES = {"direct": "direct", "indirect": "reflected on", "ambient": "ambient"}
"""Of the light groups."""
STAGES = {"direct": "laser light", "indirect": "reflected laser light", "ambient": "ambient light"}
"""Stage of the render in which each light group is made."""


def noise_text(of_sigma: float, depth: float | None) -> str:
    """Standard deviation over a row's own, and of its depth, m, where that is known."""
    return f"{of_sigma:.2g} sigma" if depth is None else f"{of_sigma:.2g} sigma, {depth * 1e6:.2g} um"


def seconds_text(seconds: float) -> str:
    """What a pilot foretells, as roughly as it does."""
    return f"about {float(f'{seconds:.1g}'):g} s of the processor"


def sentences(plan: Plan) -> tuple[list[str], list[str]]:
    """What is computed, and what is left out, each with its reason."""
    found = list(_all(plan))
    return [*plan.text, *(text for computed, text in found if computed)], [
        text for computed, text in found if not computed
    ]


def plan_lines(plan: Plan) -> list[str]:
    """The same in the order of the plan, one line each."""
    return [*plan.text, *(text if computed else f"left out: {text}" for computed, text in _all(plan))]


def foretold_lines(foretold: Mapping[str, float]) -> list[str]:
    """What the light groups will take, as their pilots foretell."""
    return [f"{NAMES[group]} light: {seconds_text(seconds)}, by its pilot" for group, seconds in foretold.items()]


def quality_lines(quality: tuple[GroupQuality, ...]) -> list[tuple[str, str]]:
    """Name and quality of every light group that has begun, and what the errors of all of them do to the line."""
    lines = [(group_name(one), quality_text(one)) for one in quality]
    for laser, noise in line_noise(quality).items():
        told = f"moves {LINES_KNOWN:.0%} of the rows by at most {noise:.2g} sigma"
        told = told if math.isfinite(noise) else "how far it moves the line is not known"
        undecided = sum(one.undecided or 0 for one in quality if one.laser == laser)
        if undecided:
            told += f"; {undecided} rows hang on less than that, and may come out another way"
        lines.append((f"{laser}, noise of all light", told))
    return lines


def stage_note(stage: str, quality: tuple[GroupQuality, ...], foretold: Mapping[str, float] | None = None) -> str:
    """The quality of the groups that are made in a stage of the render, on one line; empty: there is none yet.

    foretold: processor seconds by light group.
    """
    notes = [quality_text(one) for one in quality if STAGES[one.group] == stage]
    notes += [seconds_text(seconds) for group, seconds in (foretold or {}).items() if STAGES[group] == stage]
    return "; ".join(notes)


def group_name(quality: GroupQuality) -> str:
    """Of a light group, with its laser's."""
    if quality.laser is None:
        return "ambient"
    return f"{quality.laser}, {NAMES[quality.group]}"


def quality_text(quality: GroupQuality) -> str:
    """Error, target and work of a light group, and what it lost."""
    places = 1 if quality.group == "indirect" else 2
    parts = []
    if quality.of == "line":
        known = (
            f"noise moves the line by {quality.error:.2g} sigma" if math.isfinite(quality.error) else "line not known"
        )
        parts.append(f"{known}, goal {quality.target:.2g}{' out of reach' if quality.out_of_reach else ''}")
        if quality.unknown:
            parts.append(f"{quality.unknown} of {quality.lines} rows by more")
        if quality.image_error is not None and math.isfinite(quality.image_error):
            end = "" if quality.image_target is None else f" (not needed; {quality.image_target:.0%} would end it too)"
            places = 2 if quality.group == "direct" else 0
            # beyond that only a few paths have met the image, and the figure says no more
            is_known = quality.image_error < 1.0
            size = f"{quality.image_error:.{places}%}" if is_known else "over 100%"
            parts.append(f"image error {size}{end}")
        if quality.coarse_error is not None:
            parts.append(f"elsewhere interpolated to {quality.coarse_error:.1%}")
    elif not math.isnan(quality.error):
        parts.append(f"error {quality.error:.{places}%}, target {quality.target:.{places}%}")
    match quality.unit:
        case "light paths":
            parts.append(f"{quality.work / 1e6:.2g} million light paths")
        case "samples a pixel":
            parts.append(f"{quality.work:.{0 if quality.coarse_error is None else 1}f} of {quality.most:.0f} samples")
    if quality.share is not None:
        alone = f", {quality.spread:.0%} of it spread, as one path alone made a peak" if quality.spread else ""
        parts.append(f"{quality.share:.2%} of the direct light{alone}")
    if quality.clamped is not None:
        parts.append(f"clamped {quality.clamped:.0f} {'times' if quality.laser else 'contributions'} (biased)")
    if quality.invalid:
        parts.append(f"{quality.invalid:.0f} contributions were no number, and were left out")
    return ", ".join(parts)


def _all(plan: Plan) -> Iterator[tuple[bool, str]]:
    """Whether it is computed, and the sentence, of every step and every setting that bounds it."""
    if plan.goal is not None:
        known = f"its noise moves the line by less than {plan.goal:g} of its sigma"
        yield True, f"goal: reflected light ends where {known}, or where its image reaches the reflection error"
    for step in plan.steps:
        if step.reason == "absent" and step.group == "indirect":
            continue  # nothing in the scene makes such light, or none that the pilot met
        yield from _step(step, plan)
    if plan.pilot_steps:
        steps = ", ".join(str(step + 1) for step in plan.pilot_steps)
        told = f"pilots on steps {steps} of {plan.frame_count}, of which the largest share counts"
        yield True, f"the same for all frames: {told}"


def _step(step: TransportStep, plan: Plan) -> Iterator[tuple[bool, str]]:
    match step.group:
        case "direct":
            yield True, f"direct: {LIGHT['direct', 'direct']}"
        case "indirect":
            yield _indirect(step, plan)
            last = [one for one in plan.of("indirect") if one.computed is not False][-1:]
            if plan.laser_clamp is not None and step in last:
                yield True, _clamp("pass of a laser's indirect light puts", plan.laser_clamp, " into a pixel")
        case "ambient":
            yield _ambient(step, plan)
            if plan.clamp is not None and step.name == "interreflection" and step.computed is not False:
                yield True, _clamp("sample of ambient light by way of two or more surfaces adds", plan.clamp, "")
        case "lens":
            yield from _lens(step, plan.lens)
        case "truth" if step.computed:
            yield True, "truth: depth, position, normal and object at every pixel's centre"
        case "truth":
            yield False, "truth at every pixel (switched off); the exact line is there"


def _indirect(step: TransportStep, plan: Plan) -> tuple[bool, str]:
    light = LIGHT["indirect", step.name]
    if step.reason == "switched off":
        return False, f"{light} - switched off, its share was not measured"
    if step.computed is None:
        least = (
            f"is below {plan.negligible or 0.0:.2%}" if plan.goal is None else f"moves no row by {plan.goal:g} sigma"
        )
        return True, f"{light}: a pilot decides kind by kind, and leaves out what {least}"
    if step.share is None:
        return True, f"{step.name}: {LIGHT['indirect', 'indirect']} - requested"
    measured = f"a pilot puts it at {step.share:.2%} +- {step.error or 0.0:.2%} of the direct light in the image"
    if math.isinf(step.share):
        measured = "there is no direct light in the image to compare it with"
    if step.moves is not None and step.share:
        measured += f", which may move the line by {step.moves:.2g} of its sigma"
    match step.reason:
        case "requested":
            return True, f"{step.name}: {light} - requested; {measured}"
        case "implied":
            others = [one.name for one in plan.of("indirect") if one.computed and one.reason != "implied"]
            return True, f"{step.name}: {light} - comes with {others[-1]}; {measured}"
        case "negligible" if step.moves is not None:
            measured += f", less than the goal of {plan.goal or 0.0:g}"
        case "negligible":
            measured += f", below the negligible {plan.negligible or 0.0:.2%}"
        case "not requested":
            measured += ", not requested"
    return (
        (True, f"{step.name}: {light} - {measured}")
        if step.computed
        else (False, f"{light} ({step.name}) - {measured}")
    )


def _ambient(step: TransportStep, plan: Plan) -> tuple[bool, str]:
    if step.reason == "absent":
        return True, "ambient: none, the scene has no lamp and dark surroundings"
    if step.reason == "unreachable":
        return False, "light of point lamps by way of polished glass - no path from the camera meets a point"
    light = LIGHT["ambient", step.name]
    if step.name == "ambient":
        width, height = plan.image_size or (0, 0)
        effort = f"to {plan.ambient_error or 0.0:.1%} or {plan.ambient_samples} samples a pixel"
        # with fewer the lines cannot be looked at, and the image is rendered in their place
        if plan.goal is not None and (plan.ambient_samples or 0) >= LEAST_SAMPLES:
            most = f"{plan.ambient_samples} samples a pixel on average at most"
            effort = f"about the line as well as the goal needs, elsewhere of few samples and interpolated; {most}"
        return True, f"ambient: {light} on {width} x {height} pixels, {effort}"
    if step.reason == "switched off":
        return False, f"{light} - switched off, its share was not measured"
    if step.computed is None:
        return True, f"{light}: a pilot decides, it is left out below {plan.negligible or 0.0:.2%} of the light"
    reasons = ["requested"] if step.reason == "requested" else []
    if step.share is not None and math.isinf(step.share):
        reasons.append("nothing that is seen is lit otherwise")
    elif step.share is not None:
        reasons.append(f"a pilot puts it at {step.share:.2%} +- {step.error or 0.0:.2%} of what one surface reflects")
    why = "; ".join(reasons)
    if not step.computed:
        return False, f"{light} - {why}, below the negligible {plan.negligible or 0.0:.2%}"
    bound = "" if plan.max_bounces is None else f", {plan.max_bounces} at most"
    return True, f"interreflection: {light}{bound} - {why}"


def _lens(step: TransportStep, lens: ThinLens | None) -> Iterator[tuple[bool, str]]:
    if step.reason == "pinhole":
        if step.name == "defocus":
            blur = "the lens's blur (defocus, diffraction) - rendered as a pinhole, every depth is in focus"
            yield False, f"{blur}; the sensor's defocus, where it is on, blurs by depth when the image is developed"
    elif lens is None or step.name == "diffraction":
        yield False, "diffraction - the sensor's lens blur stands for it"
    else:
        focus = "far away" if lens.focus_distance is None else f"at {lens.focus_distance:.4g} m"
        line = f"lens: f/{lens.f_number:g} focused {focus}, {1e3 * lens.aperture:.3g} mm of aperture sampled"
        if lens.tilt > 0.0:
            line += f", plane of focus tilted by {math.degrees(lens.tilt):.3g} deg"
        if lens.blind > 0.0:
            line += f"; in {lens.blind:.0%} of the image no depth is in focus"
        yield True, f"{line}; the sensor's defocus is not applied again"


def _clamp(what: str, most: float, where: str) -> str:
    return f"clamp: no {what} more than {most:g} W/(m^2 sr){where} - biased, too dark where it cuts"
