"""Scanners with known truth, photographs of them as files, and projects that are wrong about them.

python -m tests.validation.twin_scenes FOLDER [NAME ...]     write them, fit their twins, print the table
"""

from __future__ import annotations

import json
import math
import sys
import time
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any, Literal

import cv2
import numpy as np
from click.testing import CliRunner

from main import cli
from render.frame import Frame
from render.laser.laser import Divergence, Waist
from render.run import Run
from render.sensor.develop import develop, expected_electrons
from render.sensor.sensor import Sensor
from render.world.world import build_world
from studio.editing.presets import preset_named
from studio.photographs.twin_light import numbers_of
from studio.project.project import Project
from studio.project.templates import template_folder
from studio.scan.stages import Clock, render_step, scaled

SCALE = 0.25
"""Of the templates' 2448 x 2048 px."""
PEAK = 0.9
"""Quantile of the line's peaks that `level` speaks of."""
DIVERGENCE, THIN = Divergence(full_angle=4e-3), Waist(radius=0.35e-3, focus_distance=0.9, m_squared=3.0)
NEAR = Waist(radius=0.2e-3, focus_distance=0.80, m_squared=30.0)
NEARER = Waist(radius=0.2e-3, focus_distance=0.77, m_squared=30.0)
"""Sheets that are about as wide everywhere, and such that widen on the parts."""
WIDE = Divergence(full_angle=7e-3)
LAMP = 1.0
"""Of the template's lamps, where a photograph has other light."""


@dataclass(frozen=True)
class Scanner:
    """A real scanner: what its twin has to find, and what its project has wrong.

    level: peak of the line over what saturates. room: mean of other light over the same.
    """

    template: str
    sensor: str = "industrial mono"
    sheet: Divergence | Waist = DIVERGENCE
    blur_px: float = 0.8
    read_noise: float = 6.0
    full_well: float = 8000.0
    gain: float | None = None
    bits: Literal[8, 10, 12] = 12
    black_level: float = 32.0
    halo: float = 0.0
    halo_px: float = 6.0
    level: float = 0.7
    room: float = 0.01
    speckle: str = "off"
    wavelength_nm: float = 450.0
    shots: int = 4
    kind: Literal["png", "jpg"] = "png"
    wrong_sheet: float = 1.5
    wrong_blur: float = 0.6
    wrong_noise: float = 2.0
    """Times that the project has sheet, blur, and read noise and full well."""


@dataclass(frozen=True)
class Shot:
    """Files of a scanner's photographs, the project that is wrong, and that of the scanner, as bright."""

    project: Path
    photographs: list[Path]
    true: Project


def of_scanner(project: Project, scanner: Scanner, wrong: bool) -> Project:
    """The template's project with the scanner's sheet and sensor, or with what its owner takes them for."""
    sheet, blur, noise = (scanner.wrong_sheet, scanner.wrong_blur, scanner.wrong_noise) if wrong else (1.0, 1.0, 1.0)
    first = project.scene.lasers[0].model_copy(
        update={"sheet": wider(scanner.sheet, sheet), "wavelength_nm": scanner.wavelength_nm}
    )
    scene = project.scene.model_copy(update={"rig": project.scene.rig.model_copy(update={"lasers": (first,)})})
    pitch = scene.camera.pixel_pitch
    sensor = Sensor(**preset_named("sensors", scanner.sensor, "scanner").values["sensor"])
    values = sensor.model_dump() | {
        "exposure_time": project.sensor.exposure_time, "blur_sigma": blur * scanner.blur_px * pitch,
        "read_noise": noise * scanner.read_noise, "full_well": noise * scanner.full_well,
        "gain": None if scanner.gain is None else scanner.gain / noise, "speckle": scanner.speckle, "scatter": 0.0,
        "halo_sigma": scanner.halo_px * pitch, "halo": scanner.halo,
    }  # fmt: skip
    if sensor.processing is None:
        values |= {"bits": scanner.bits, "black_level": scanner.black_level, "halo": 0.0 if wrong else scanner.halo}
    render = project.render.model_copy(update={"truth_images": False, "transport": "direct"})
    return project.model_copy(update={"scene": scene, "render": render, "sensor": Sensor.model_validate(values)})


def wider(sheet: Divergence | Waist, scale: float) -> Divergence | Waist:
    """The sheet `scale` times as wide at every distance."""
    if isinstance(sheet, Divergence):
        return Divergence(full_angle=2.0 * math.atan(scale * math.tan(sheet.full_angle / 2.0)))
    values = {"radius": scale * sheet.radius, "m_squared": scale**2 * sheet.m_squared}
    return Waist.model_validate({**sheet.model_dump(), **values})


@lru_cache(maxsize=32)
def rendered(template: str, sheet: Divergence | Waist, wavelength_nm: float) -> tuple[Project, Frame]:
    folder = template_folder(template)
    project = scaled(Project.load(folder / "project.json"), SCALE)
    true = of_scanner(project, Scanner(template, sheet=sheet, wavelength_nm=wavelength_nm), wrong=False)
    clock = Clock(lambda stage, done: None, lambda: False)
    return project, render_step(true, build_world(true.scene, folder, 0), 0, clock, Run(threads=1))


def lit(frame: Frame, true: Project, scanner: Scanner) -> tuple[Frame, float]:
    """The frame with laser and lamps as bright as they are asked for, and how much brighter the laser is."""
    bare = true.sensor.model_copy(update={"dark_current": 0.0})
    dark = replace(frame, ambient=None, laser_indirect=())
    peaks = expected_electrons(dark, true.scene, bare).max(axis=1)
    strength = scanner.level * scanner.full_well / float(np.quantile(peaks[peaks > 0.05 * peaks.max()], PEAK))
    ambient = frame.ambient
    if ambient is not None:
        alone = replace(frame, laser_direct=(np.zeros_like(frame.laser(0)),), laser_indirect=())
        mean = float(expected_electrons(alone, true.scene, bare).mean())
        ambient = (scanner.room * scanner.full_well / max(mean, 1e-9) * ambient).astype(np.float32)
    direct = ((strength * frame.laser(0)).astype(np.float32),)
    return replace(frame, laser_direct=direct, laser_indirect=(), ambient=ambient), strength


def photographed(scanner: Scanner, folder: Path, seed: int = 0) -> Shot:
    """Photographs and the wrong project as files in the folder."""
    template, frame = rendered(scanner.template, scanner.sheet, scanner.wavelength_nm)
    true = of_scanner(template, scanner, wrong=False)
    frame, strength = lit(frame, true, scanner)
    paths = [folder / f"shot{k}.{scanner.kind}" for k in range(scanner.shots)]
    for k, path in enumerate(paths):
        write(path, true.scene, true.sensor, frame, 1000 * seed + k)
    project = folder / "project.json"
    of_scanner(template, scanner, wrong=True).save(project)
    laser = true.scene.lasers[0]
    rig = true.scene.rig.model_copy(update={"lasers": (laser.model_copy(update={"power": strength * laser.power}),)})
    return Shot(project, paths, true.model_copy(update={"scene": true.scene.model_copy(update={"rig": rig})}))


def write(path: Path, scene: Any, sensor: Sensor, frame: Frame, seed: int) -> None:
    """A photograph as a file: what is compressed is so by the file."""
    options: list[int] = []
    if path.suffix == ".jpg":
        assert sensor.processing is not None and sensor.processing.jpeg_quality is not None
        options = [cv2.IMWRITE_JPEG_QUALITY, sensor.processing.jpeg_quality]
        how = sensor.processing.model_copy(update={"jpeg_quality": None})
        sensor = sensor.model_copy(update={"processing": how})
    pixels = develop(frame, scene, sensor, seed=seed, threads=1).pixels
    cv2.imwrite(str(path), pixels if pixels.ndim == 2 else pixels[..., ::-1], options)


def twin(shot: Shot) -> tuple[int, dict[str, Any], Project | None]:
    """Exit code, what `main.py twin` tells of a scanner, and the project it made."""
    out = shot.project.with_name("made.json")
    out.unlink(missing_ok=True)
    arguments = ["twin", str(shot.project), *map(str, shot.photographs), "--out", str(out), "--threads", "1"]
    done = CliRunner().invoke(cli, [*arguments, "--json", "--quiet"])
    if done.exception is not None and not isinstance(done.exception, SystemExit):
        raise done.exception
    answer = json.loads(done.stdout)
    return done.exit_code, answer, Project.load(out) if done.exit_code == 0 else None


SCANNERS = {
    "plane": Scanner("plane"),
    "plane, 8 bits": Scanner("plane", bits=8, black_level=8.0, full_well=4000.0, read_noise=12.0),
    "plane, halo": Scanner("plane", halo=0.08, room=0.05, wrong_sheet=0.7),
    "plane, speckle": Scanner("plane", speckle="depolarised"),
    "step block, waist": Scanner("step_block", sheet=NEAR, blur_px=0.9, full_well=15000.0, read_noise=10.0),
    "groove": Scanner("v_groove", blur_px=1.2, level=0.4, read_noise=15.0),
    "groove, 8 bits, speckle": Scanner("v_groove", bits=8, black_level=8.0, speckle="depolarised", full_well=4000.0),
    "sphere": Scanner("sphere", blur_px=1.0, room=0.1),
    "sphere, bright": Scanner("sphere", level=1.6, gain=0.3, read_noise=4.0),
    "sphere, waist": Scanner("sphere", sheet=NEARER, blur_px=0.8, wrong_sheet=1.3),
    "webcam plane": Scanner("plane", "webcam", full_well=5000.0, read_noise=8.0, halo=0.03, halo_px=5.0, kind="jpg",
                            wavelength_nm=520.0, speckle="depolarised", room=0.03, shots=3),
    "webcam sphere": Scanner("sphere", "webcam", full_well=5000.0, read_noise=8.0, halo=0.03, halo_px=5.0, kind="jpg",
                             wavelength_nm=640.0, speckle="depolarised", room=0.03, shots=3),
    "phone groove": Scanner("v_groove", "phone", full_well=6000.0, read_noise=6.0, halo=0.015, halo_px=5.0, kind="jpg",
                            wavelength_nm=520.0, speckle="off", room=0.05),
    "phone plane": Scanner("plane", "phone", full_well=6000.0, read_noise=6.0, halo=0.015, halo_px=5.0,
                           wavelength_nm=450.0, speckle="off", room=0.02, level=0.5),
}  # fmt: skip

THIN_LINES = {
    "groove, thin": Scanner("v_groove", sheet=THIN, wrong_sheet=0.8, blur_px=0.6),
}
"""At one phase of the pixels, so that how the line's width is shared by sheet and blur changes what its width is."""


OTHERS = {
    "weld seam": Scanner("weld_seam"),
    "step block": Scanner("step_block"),
    "groove, wide": Scanner("v_groove", sheet=WIDE),
    "sphere, wide": Scanner("sphere", sheet=WIDE),
    "phone sphere": replace(SCANNERS["phone plane"], template="sphere"),
    "phone weld seam": replace(SCANNERS["phone groove"], template="weld_seam"),
    "phone step block": replace(SCANNERS["phone groove"], template="step_block"),
    "webcam groove": replace(SCANNERS["webcam plane"], template="v_groove", speckle="off"),
    "webcam step block": replace(SCANNERS["webcam plane"], template="step_block", speckle="off"),
}
"""Scanners that no twin is judged by, whose rehearsals by the true numbers tell what rehearsals leave out."""


def truths(true: Project) -> dict[str, float]:
    sensor = true.sensor
    return {"blur_px": sensor.blur_sigma / true.scene.camera.pixel_pitch, "halo": sensor.halo,
            "gain": numbers_of(true, 0).gain, "read_noise": sensor.read_noise, "scatter": sensor.prnu,
            "laser_power_w": true.scene.lasers[0].power}  # fmt: skip


if __name__ == "__main__":
    target = Path(sys.argv[1])
    for name in sys.argv[2:] or SCANNERS:
        scanner = {**SCANNERS, **THIN_LINES}[name]
        folder = target / name.replace(" ", "_").replace(",", "")
        folder.mkdir(parents=True, exist_ok=True)
        start = time.perf_counter()
        shot = photographed(scanner, folder)
        between = time.perf_counter()
        code, answer, made = twin(shot)
        print(f"== {name}: {between - start:.1f} s, {time.perf_counter() - between:.1f} s, code {code}", flush=True)
        if made is None:
            print(answer["error"])
            continue
        known = {**truths(shot.true), "scale": 1.0 / scanner.wrong_sheet}
        if "line_px" in answer:
            known["sheet_px"] = answer["sheet_px"]["value"] / answer["scale"]["value"] / scanner.wrong_sheet
            known["line_px"] = math.hypot(known["sheet_px"], scanner.blur_px)
        for key, told in answer.items():
            if isinstance(told, dict):
                true = known.get(key)
                ratio = f"{told['value'] / true - 1:+.1%}" if true else ""
                sigmas = f"{(told['value'] - true) / told['sigma']:+.1f}" if true and told["sigma"] else ""
                numbers = f"{told['value']:10.4g} +- {told['sigma'] or 0:8.2g} {true or math.nan:9.4g} {ratio:>8s}"
                print(f"  {key:12s} {numbers} {sigmas:>6s}  {told['kept'] or ''}")
        for warning in answer["warnings"]:
            print("  !", warning)
