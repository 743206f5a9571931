"""A texture moves the line; how far is told by the light along it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from analysis.line.extract import extract
from analysis.line.texture import Texture, texture
from tests.analysis.line.line_images import electrons
from tests.analysis.line.troubles import PLAIN, READ_NOISE, TEXTURE_GRAIN, TROUBLES, measured, photographed, textured

TEXTURED = TROUBLES["texture of 5 %"]
ALIKE = Texture(1.0, TEXTURE_GRAIN).length


@pytest.mark.parametrize("width", [1.0, 2.0, 6.0])
def test_the_centre_of_light_moves_as_the_closed_form_says(width: float) -> None:
    """Of 40,000 places on a texture, of which a line's light is weighed by a Gaussian."""
    rng = np.random.default_rng(1)
    field = textured((200, 4000), rng)
    x = np.arange(-40, 41)
    weight = np.exp(-0.5 * (x / width) ** 2)
    weight /= weight.sum()
    moved = np.apply_along_axis(np.convolve, 1, field, -x * weight, "valid")
    light = np.apply_along_axis(np.convolve, 1, field, weight, "valid")
    expected = Texture(float(light.var()), TEXTURE_GRAIN).moves(np.array(width))
    assert light.var() == pytest.approx(1.0 / math.sqrt(1.0 + (width / TEXTURE_GRAIN) ** 2), rel=0.1)
    assert moved.var() == pytest.approx(float(expected), rel=0.1)


@pytest.mark.parametrize("known", [True, False], ids=["noise known", "noise estimated"])
@pytest.mark.parametrize(("signal", "sigma"), [(1000.0, 2.0), (10000.0, 0.6), (10000.0, 2.0)])
def test_sigma_holds_what_a_texture_does(signal: float, sigma: float, known: bool) -> None:
    """At 10,000 e- and 2 px 2 sigma of the counts alone hold 38 %."""
    line, centre = measured(TEXTURED, signal, sigma, 2000, seed=31, known=known)
    alone = line.flag[:, 0] == 0
    ratio = (line.u[:, 0] - centre)[alone] / line.sigma_u[alone, 0]
    chance = 3.0 * math.sqrt(2.0 * ALIKE / alone.sum())
    assert float(np.mean(ratio**2)) == pytest.approx(1.0, abs=0.15 + chance)
    assert line.length_apart is not None
    assert 1.0 < np.median(line.length_apart) < 1.5 * ALIKE


def test_a_plain_line_and_one_of_an_uneven_shape_have_none() -> None:
    line, _ = measured(PLAIN, 3000.0, 2.0, 2000, seed=32)
    assert texture(line, electrons(READ_NOISE)) is None
    # a rough surface moves the line and leaves its light as it is
    rough = replace(line, u=line.u + np.random.default_rng(2).normal(0.0, 0.5, line.u.shape))
    assert texture(rough, electrons(READ_NOISE)) is None


def test_too_few_scan_lines_tell_nothing() -> None:
    image, _, noise = photographed(TEXTURED, 10000.0, 2.0, 400, seed=33)
    assert texture(extract(image, noise=noise), noise) is None


def test_a_texture_upside_down_is_the_same() -> None:
    image, _, noise = photographed(TEXTURED, 10000.0, 2.0, 640, seed=34)
    line, reverse = (extract(one, noise=noise) for one in (image, image[::-1].copy()))
    np.testing.assert_allclose(line.sigma_u, reverse.sigma_u[::-1], rtol=1e-6)
