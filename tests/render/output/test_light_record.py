"""What versions before the third of a frame's description held in words and counts is read as plan and quality."""

from __future__ import annotations

import json
from pathlib import Path

from render.base.counts import (
    AMBIENT_SAMPLES,
    DIRECT_ERROR,
    DIRECT_SAMPLES,
    INDIRECT_ERROR,
    LIGHT_PATHS,
    LIT_PIXELS,
    RAYS,
    Quantity,
    counts_from,
    counts_record,
)
from render.output.frame_files import read_frame, write_frame
from render.output.sidecar import from_text, sealed, sealed_text, to_text
from render.plan import GroupQuality, Plan
from tests.render.output.test_frame_files import frame_of, scene_of


def test_counts_of_a_first_version_are_read_by_the_names_that_they_had() -> None:
    old = {
        "rays": 7.0,
        "lit pixels, error probe": 1e7,
        "relative error, error probe": 0.01,
        "samples, mean, a pixel": 4.0,
        "else": 2.0,
    }
    lasers = ["error probe", "mean, a pixel"]
    assert counts_from(old, lasers) == {
        RAYS: 7.0,
        LIT_PIXELS.of(0): 1e7,
        DIRECT_ERROR.of(0): 0.01,
        DIRECT_SAMPLES.of(1): 4.0,
        Quantity("else"): 2.0,
    }
    assert LIT_PIXELS.of(0).kind == "count" and LIT_PIXELS.of(0).label(lasers) == "lit pixels, error probe"


def test_a_frame_of_the_second_version_has_its_sentences_and_its_counts_as_quality(tmp_path: Path) -> None:
    written = write_frame(tmp_path, "old", frame_of(scene_of()), None, scene_of())[-1]
    record = json.loads(written.read_text(encoding="utf-8"))
    del record["quality"]
    name = record["lasers"][1]["name"]
    counts = {RAYS: 9.0, DIRECT_ERROR.of(1): 0.002, DIRECT_SAMPLES.of(1): 50.0, LIT_PIXELS.of(1): 20.0}
    counts |= {INDIRECT_ERROR.of(1): 0.2, LIGHT_PATHS.of(1): 1e6, AMBIENT_SAMPLES: 3.0}
    targets = {"laser_error": 0.003, "indirect_error": 0.1, "light_paths": 1e7, "ambient_error": 0.01}
    record |= {"format_version": 2, "plan": "direct: all\nleft out: else", "counts": counts_record(counts, float)}
    record["made_of"] = {"targets": {**targets, "ambient_samples": 16}}
    written.write_text(to_text(sealed(record)), encoding="utf-8")
    frame = read_frame(written)
    assert frame.plan == Plan(text=("direct: all", "left out: else")) and frame.counts == {RAYS: 9.0}
    direct, indirect, ambient = frame.quality
    assert direct == GroupQuality("direct", name, 0.002, 0.003, 50.0, "samples", lit_pixels=20.0)
    assert indirect == GroupQuality("indirect", name, 0.2, 0.1, 1e6, "light paths", 1e7)
    assert (ambient.laser, ambient.work, ambient.most, ambient.target) == (None, 3.0, 16.0, 0.01)
    assert [one.reason for one in frame.quality] == ["target", "unfinished", "unfinished"]


def test_a_sealed_text_is_that_of_the_sealed_record() -> None:
    record = {"format": "blazer-frame", "lasers": [{"name": "a", "curve": [1.5, None]}, {"name": "b"}], "step": 3}
    assert sealed_text(record) == to_text(sealed(record)) == sealed_text(sealed(record))
    assert from_text(sealed_text({**record, "format_version": 3}), "here")["step"] == 3
