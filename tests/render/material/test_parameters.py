"""What a description of a material becomes for the kernels."""

import pytest

from render.base.errors import InputError
from render.material import bsdf
from render.material.dielectric import substance_index, substances
from render.material.material import Emitter, Glass, Subsurface
from render.material.record import ANISOTROPY, EMITTED, EXTINCTION, INDEX, SCATTERED
from render.material.spectrum import BAND_CENTRES_NM

# n at the helium line, 587.6 nm, as data sheets give it
N_D = {"BK7": 1.5168, "SF11": 1.7847, "fused_silica": 1.4585, "sapphire": 1.7682, "acrylic": 1.491,
       "polycarbonate": 1.585, "polystyrene": 1.591, "water": 1.333}  # fmt: skip


@pytest.mark.parametrize("name", N_D)
def test_every_substance_has_the_index_of_its_data_sheet(name):
    assert N_D.keys() == substances().keys()
    assert substance_index(name, 587.56) == pytest.approx(N_D[name], abs=1e-3)
    assert substance_index(name, 450.0) > substance_index(name, 660.0)
    assert len(substances()[name]["source"]) > 20


def test_glass_is_bent_as_the_lasers_wavelength_is():
    # data sheet of N-SF11: Abbe number 25.68
    blue, yellow, red = (Glass(substance="SF11").pack((nm,) * 3)[INDEX] for nm in (486.13, 587.56, 656.27))
    assert (yellow - 1) / (blue - red) == pytest.approx(25.68, abs=0.01)
    assert Glass(index=1.6).pack((5000.0,) * 3)[INDEX] == 1.6
    with pytest.raises(InputError, match=r"material.substance: .*acrylic.*1550 nm.*436 to 1053 nm.*index as a number"):
        Glass(substance="acrylic").pack((1550.0,) * 3)


def test_nearly_polished_glass_is_polished():
    assert bsdf.is_specular_row(Glass(roughness=0.004).pack(BAND_CENTRES_NM))
    assert not bsdf.is_specular_row(Glass(roughness=0.005).pack(BAND_CENTRES_NM))


def test_a_medium_is_interpolated_between_the_bands():
    wax = Subsurface(mean_free_path=(2e-3, 1e-3, 0.5e-3), scattering_albedo=(0.9, 0.8, 0.7), anisotropy=0.3)
    row = wax.pack(BAND_CENTRES_NM)
    assert row[EXTINCTION : EXTINCTION + 3] == pytest.approx([500, 1000, 2000])
    assert row[SCATTERED : SCATTERED + 3] == pytest.approx([0.9, 0.8, 0.7])
    assert row[ANISOTROPY] == 0.3
    middle = wax.pack((0.5 * (BAND_CENTRES_NM[0] + BAND_CENTRES_NM[1]),) * 3)
    assert middle[EXTINCTION] == pytest.approx(1 / 1.5e-3) and middle[SCATTERED] == pytest.approx(0.85)


@pytest.mark.parametrize("bands_nm", [BAND_CENTRES_NM, (660.0,) * 3])
def test_an_emitter_keeps_its_radiance_at_every_wavelength(bands_nm):
    row = Emitter(radiance=(1.0, 2.0, 3.0)).pack(bands_nm)
    assert row[EMITTED : EMITTED + 3].tolist() == [1.0, 2.0, 3.0]
    assert bsdf.is_diffuse(row) and not bsdf.is_boundary(row)
