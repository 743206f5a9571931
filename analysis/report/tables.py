"""The report's tables: measures, steps, what was scanned with what, and what it cost."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from analysis.measures import Measures
from analysis.report.colour import hex_colour, method_colour, method_name, wavelength_colour
from analysis.report.model import ReportInput, Tables
from analysis.report.total import total
from analysis.report.units import (
    NONE,
    count,
    degrees,
    digits,
    micrometres,
    millimetres,
    milliseconds,
    milliwatts,
    percent,
    seconds,
)
from render.laser.laser import Divergence
from render.material.material import (
    BaseMaterial,
    Blend,
    Coated,
    Conductor,
    Emitter,
    FromMesh,
    Glass,
    GreyTexture,
    Lambertian,
    Material,
    Subsurface,
    Texture,
)
from render.scene.shape import MeshFile
from render.sensor.sensor import Processing

MOST_STEPS = 24
FALSE_ARE = " (off the surface only: they have no true position or depth)"
MEASURE_COLUMNS = ("n", "bias", "sigma", "RMSE", "robust sigma", "P95", "outliers", "lag 1", "within ±2 sigma")


@dataclass(frozen=True)
class MethodTable:
    """All measures of one method on one laser's images."""

    name: str
    colour: str
    rows: list[tuple[str, list[str]]]
    """Quantity with its unit, and its cells in the order of `MEASURE_COLUMNS`."""
    lines: list[tuple[str, str]]
    """Counts of scan lines."""


def measure_tables(report: ReportInput) -> list[MethodTable]:
    """One for each laser and method."""
    tables = []
    for i, laser in enumerate(report.scene.lasers):
        for k in range(report.record.method_count(i)):
            found = total(report.record.chosen(i, k))
            prefix = f"{laser.name}: " if len(report.scene.lasers) > 1 else ""
            rows = [
                ("position, px", _cells(found.u, 1.0)),
                ("depth_z, µm", _cells(found.depth_z, 1e6)),
                ("off the surface, µm", _cells(found.surface, 1e6)),
            ]
            lines = [
                ("with a line to be seen", count(found.truth_rows)),
                ("with a point", count(found.valid_rows)),
                ("rightly measured", f"{count(found.measured_rows)} ({percent(found.completeness)})"),
                ("with a point but no line", f"{count(found.false_rows)}{FALSE_ARE if found.false_rows else ''}"),
                *([("with neither, but a peak", count(found.depthless_rows))] if found.depthless_rows else []),
            ]
            tables.append(MethodTable(prefix + method_name(found.method), method_colour(found.method), rows, lines))
    return tables


def _cells(m: Measures, scale: float) -> list[str]:
    lengths = [digits(scale * value) for value in (m.bias, m.sigma, m.rmse, m.robust_sigma, m.p95)]
    lag = f"{m.autocorrelation:.2f}" if np.isfinite(m.autocorrelation) else NONE
    return [count(m.count), *lengths, percent(m.outlier_rate), lag, percent(m.coverage)]


def step_table(report: ReportInput) -> tuple[list[str], list[list[str]], bool]:
    """Header, rows, and whether steps were left out; the first method, all lasers together."""
    header = ["step", "points", "complete", "bias", "sigma", "RMSE", "P95", "outliers"]
    steps = report.record.steps
    picked = np.unique(np.linspace(0, len(steps) - 1, min(MOST_STEPS, len(steps))).astype(int))
    rows = []
    for one in (steps[i] for i in picked):
        m = one.depth_z
        rows.append(
            [str(one.step + 1), count(one.points), percent(one.completeness)]
            + [micrometres(value) for value in (m.bias, m.sigma, m.rmse, m.p95)]
            + [percent(m.outlier_rate)]
        )
    return header, rows, len(picked) < len(steps)


def scene_tables(report: ReportInput) -> Tables:
    """Camera, lasers, objects, light, motion, sensor, and the caller's own settings."""
    scene, camera = report.scene, report.scene.camera
    lens = camera.lens
    focus = "far away" if lens.focus_distance is None else millimetres(lens.focus_distance)
    rendered = "through its aperture" if lens.model == "thin-lens" else "as a pinhole"
    optics = f"{millimetres(camera.focal_length)}, f/{lens.f_number:g}, transmission {lens.transmission:g}"
    shape = f"fx {camera.fx:.2f}, fy {camera.fy:.2f}, cx {camera.cx:.2f}, cy {camera.cy:.2f}, skew {camera.skew:.3g} px"
    tables: Tables = {
        "Camera": {
            "Image": f"{camera.width} × {camera.height} px of {micrometres(camera.pixel_pitch)}",  # noqa: RUF001
            "Intrinsics": shape + " (pixel centres at integers)",
            "Image distance": millimetres(camera.image_distance),
            "Distortion": ", ".join(f"{c:.6g}" for c in camera.distortion) if camera.has_distortion else "none",
            "Lens": f"{optics}, focused {focus}; rendered {rendered}",
        }
    }
    for i, laser in enumerate(scene.lasers):
        plane = scene.laser_plane(i)
        offset = scene.T_camera_laser(i)[:3, 3]
        sheet = laser.sheet
        thickness = (
            f"divergence {sheet.full_angle * 1e3:.3g} mrad (full, 1/e²)"
            if isinstance(sheet, Divergence)
            else f"waist {micrometres(sheet.radius)} at {millimetres(sheet.focus_distance)}, M² {sheet.m_squared:g}"
        )
        tables[f"Laser “{laser.name}”"] = {
            "Light": f"{milliwatts(laser.power)} at {laser.wavelength_nm:g} nm",
            "Fan": f"{degrees(laser.fan_angle)}, {laser.fan_profile}",
            "Sheet": thickness,
            "Distance from the camera": millimetres(float(np.linalg.norm(offset))),
            "Plane in the camera frame": ", ".join(f"{value:.6f}" for value in plane[:3])
            + f"; {millimetres(plane[3], 6)}",
        }
    triangles = np.bincount(report.object_id, minlength=len(scene.visible_objects))
    things = {}
    for i, item in enumerate(scene.visible_objects):
        what = item.shape.path if isinstance(item.shape, MeshFile) else item.shape.kind.replace("_", " ")
        number = f", {count(float(triangles[i]))} triangles"
        things[item.name] = f"{what}{number}, {_material(item.material)}"
    tables["Objects"] = things or {"Objects": "none"}
    bands = ", ".join(f"{value:g}" for value in scene.environment.radiance)
    tables["Light and motion"] = {
        "Environment": f"{bands} W/(m² sr) in R, G, B" if any(scene.environment.radiance) else "dark",
        **{light.name: light.kind + " light" for light in scene.lights},
        "Motion": _motion(report),
    }
    if report.sensor is not None:
        sensor = report.sensor
        tables["Sensor"] = {
            "Type": f"{sensor.colour}, {sensor.bits} bit, {digits(sensor.dn_per_electron)} DN/e⁻",
            "Exposure": milliseconds(sensor.exposure_time),
            "Full well": f"{count(sensor.full_well)} e⁻",
            "Noise": f"read {sensor.read_noise:g} e⁻, dark {sensor.dark_current:g} e⁻/s",
            "Non-uniformity": f"PRNU {percent(sensor.prnu)}, DSNU {sensor.dsnu:g} e⁻",
            "Filter": "none"
            if sensor.band_pass is None
            else f"{sensor.band_pass.centre_nm:g} nm, {sensor.band_pass.width_nm:g} nm wide",
            "Defocus": f"by {sensor.defocus_by(lens.model)}",
            **({} if sensor.processing is None else {"Processing": _processing(sensor.processing)}),
        }
    return tables | report.settings


def _processing(how: Processing) -> str:
    """What a camera does to its raw image, in words."""
    done = [f"{how.tone} tone" if how.tone != "gamma" else f"gamma {how.gamma:g}"]
    if how.denoise > 0.0:
        done.append(f"denoised over {how.denoise:g} px")
    if how.sharpening > 0.0:
        done.append(f"sharpened by {how.sharpening:g} over {how.sharpening_radius:g} px")
    done.append("8 bit" if how.jpeg_quality is None else f"JPEG {how.jpeg_quality}, {how.chroma}")
    return ", ".join(done)


def _material(material: Material) -> str:
    """A material in words, with its main parameters."""
    if isinstance(material, Blend):
        return f"{_material(material.base)}; where {material.mask.path} is white, {_material(material.over)}"
    relief = f", relief of {material.relief.path}" if material.relief is not None else ""
    return f"{_plain_material(material)}{relief}"


def _plain_material(material: BaseMaterial) -> str:
    match material:
        case Conductor():
            across = "" if material.roughness_across is None else f" along u, {material.roughness_across:g} along v"
            return f"{material.metal.replace('_', ' ')}, roughness {_numbers(material.roughness)}{across}"
        case Coated():
            coat = f"a coat of index {material.index:g}, roughness {_numbers(material.roughness)}"
            return f"{_albedo(material)} under {coat}"
        case Glass():
            what = material.substance.replace("_", " ") if material.index is None else f"index {material.index:g}"
            surface = f"roughness {_numbers(material.roughness)}, tint {_numbers(material.tint)}"
            return f"transparent, {what}, {surface}{_priority(material)}"
        case Subsurface():
            return (
                f"translucent, index {material.index:g}, roughness {material.roughness:g}, mean free path "
                f"{_numbers(material.mean_free_path, 1e3)} mm, scattering albedo "
                f"{_numbers(material.scattering_albedo)}, anisotropy {material.anisotropy:g}{_priority(material)}"
            )
        case Emitter():
            return f"shines with {_numbers(material.radiance)} W/(m^2 sr), {_albedo(material)}"
        case _:
            return f"diffuse, {_albedo(material)}"


def _priority(material: Glass | Subsurface) -> str:
    return f", priority {material.priority}" if material.priority else ""


def _albedo(material: Lambertian | Coated | Emitter) -> str:
    if isinstance(material.albedo, Texture):
        return f"albedo of {material.albedo.path}"
    if isinstance(material.albedo, FromMesh):
        return "albedo of the mesh file"
    return f"albedo {_numbers(material.albedo)}"


def _numbers(value: float | tuple[float, ...] | GreyTexture, factor: float = 1.0) -> str:
    if isinstance(value, GreyTexture):
        return f"of {value.path}"
    return ", ".join(f"{factor * each:g}" for each in (value if isinstance(value, tuple) else (value,)))


def _motion(report: ReportInput) -> str:
    motion = report.scene.motion
    if motion.kind == "none":
        return "none"
    moving = "the objects move" if motion.moves == "objects" else "the rig moves"
    return f"{motion.kind}, {moving}, {len(report.record.steps)} frames"


def laser_chips(report: ReportInput) -> list[tuple[str, str]]:
    """Name with wavelength and power, and the colour of its light."""
    return [
        (f"{laser.name}, {laser.wavelength_nm:g} nm, {milliwatts(laser.power)}",
         hex_colour(wavelength_colour(laser.wavelength_nm)))
        for laser in report.scene.lasers
    ]  # fmt: skip


def timing(report: ReportInput) -> tuple[list[tuple[str, str, float]], str]:
    """Stage, time, share of the longest (0 to 1), longest first; and the total, of several frames with their rate."""
    spent = dict(report.seconds)
    for stage, value in report.record.seconds.items():
        spent[stage] = spent.get(stage, 0.0) + value
    longest = max(spent.values(), default=0.0) or 1.0
    rows = sorted(spent.items(), key=lambda item: -item[1])
    total = sum(spent.values())
    profiles = len(report.record.steps) * len(report.scene.lasers)
    rate = f", {digits(profiles / total)} profiles a second" if len(report.record.steps) > 1 and total > 0.0 else ""
    return [(stage, seconds(value), value / longest) for stage, value in rows], f"{seconds(total)} in all{rate}"


def counts(report: ReportInput) -> list[tuple[str, str]]:
    """The renderer's counts, summed or averaged over the frames by the kind of each quantity."""
    lasers = [laser.name for laser in report.scene.lasers]
    rows = []
    for quantity, (added, frames) in report.record.counts.items():
        match quantity.kind:
            case "error":
                # such light is not known at all: how far from it is no figure
                text = percent(added / frames, 2) if added < frames else "over 100\u00a0%"
            case "mean":
                text = f"{added / frames:.3g}"
            case "seconds":
                text = seconds(added)
            case "count":
                text = count(added)
        rows.append((quantity.label(lasers), text))
    return rows
