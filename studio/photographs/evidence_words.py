"""What was chosen by the evidence of photographs, why, and what is to be doubted, for a person."""

from __future__ import annotations

from dataclasses import dataclass

from studio.photographs.evidence import DOUBTFUL, FAINT, WEAK, Evidence


@dataclass(frozen=True)
class Words:
    """What a person is told to do, where choices are made by options or by the controls of a window."""

    axis: str
    """Form of the other axis."""
    axis_and_colour: str
    look: str
    both_lines: str


OPTIONS = Words("give --axis {}", "give --axis and --laser", "see the overlay", "--peaks 2 takes both")
CONTROLS = Words(
    "choose Scan axis: {}",
    "choose Colour and Scan axis, or a rectangle about the line",
    "see what is drawn upon the photograph",
    "a rectangle about the line that is meant leaves the other out",
)


def warnings_of(evidence: Evidence, words: Words = OPTIONS) -> list[str]:
    """Doubts."""
    if max(evidence.clearest.values()) < FAINT:
        nothing = "no line stands out in the photographs, in any colour or direction"
        return [f"{nothing}: {words.look}, and {words.axis_and_colour}"]
    found = []
    chosen = evidence.clearest[evidence.axis]
    for axis, other in evidence.clearest.items():
        if axis != evidence.axis and other > WEAK * chosen:
            found.append(
                f"the line may run along the {evidence.axis} instead: then {words.axis.format(axis)} (evidence "
                f"{other:.2f} for {axis}, {chosen:.2f} for {evidence.axis})"
            )
    if max(evidence.score, evidence.second) < DOUBTFUL:
        found.append(
            f"what is taken for the line stands out weakly (evidence {evidence.score:.2f}): it may be an edge, or a "
            f"reflection: {words.look}"
        )
    return found


def told_of(evidence: Evidence, words: Words = OPTIONS) -> list[tuple[str, str]]:
    """(what, choice and reason)."""
    axis = evidence.axis
    axis_reason = ", ".join(f"{name} {score:.2f}" for name, score in evidence.clearest.items())
    by_name = evidence.clear or evidence.scores[axis]
    ranked = sorted(by_name.items(), key=lambda item: -item[1])[:4]
    reason = ", ".join(f"{name} {score:.2f}" for name, score in ranked) if len(by_name) > 1 else "given"
    found = [
        ("scan axis", f"{axis} ({axis_reason})"),
        ("laser's colour", _coloured(evidence)),
        ("looked for in", f"{_searched(evidence)} ({reason}{_why(evidence, by_name)})"),
    ]
    first, second = evidence.score, evidence.second
    if evidence.lines == 2:
        found.append(("lines", f"a second line stands out (evidence {first:.2f} and {second:.2f})"))
    elif second > WEAK * first:
        found.append(("lines", f"a second line stands out weakly (evidence {second:.2f}): {words.both_lines}"))
    else:
        found.append(("lines", f"one (evidence {first:.2f}; of a second {second:.2f})"))
    return found


def _why(evidence: Evidence, by_name: dict[str, float]) -> str:
    """Why it is not the first of them."""
    name = evidence.combination.name
    return f"; {name} is as clear as that, with less noise" if by_name[name] < max(by_name.values()) else ""


def _searched(evidence: Evidence) -> str:
    name = evidence.combination.name
    several = len(evidence.scores[evidence.axis]) > 1
    return f"{name}, all channels together" if name == "mono" and several else name


def _coloured(evidence: Evidence) -> str:
    """Its colour, and by what light."""
    if evidence.light is None:
        return evidence.colour
    of_light = ", ".join(f"{colour} {share:.0%}" for colour, share in evidence.light.items())
    grey = ": none has much more than the others" if evidence.colour == "mono" else ""
    return f"{evidence.colour} (of the line's light {of_light}{grey})"
