"""What a description of a material becomes for the kernels."""

import numpy as np
import pytest

from render.base.errors import InputError
from render.material import bsdf
from render.material.material import BAND_CENTRES_NM, Emitter, Glass, Subsurface
from render.material.parameters import material_row, substance_index, substances
from render.world.triangles import emission

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
    blue, yellow, red = (material_row(Glass(substance="SF11"), (nm,) * 3)[3] for nm in (486.13, 587.56, 656.27))
    assert (yellow - 1) / (blue - red) == pytest.approx(25.68, abs=0.01)
    assert material_row(Glass(index=1.6), (5000.0,) * 3)[3] == 1.6
    with pytest.raises(InputError, match=r"material.substance: .*acrylic.*1550 nm.*436 to 1053 nm.*index as a number"):
        material_row(Glass(substance="acrylic"), (1550.0,) * 3)


def test_nearly_polished_glass_is_polished():
    assert bsdf.is_specular_row(material_row(Glass(roughness=0.004), BAND_CENTRES_NM))
    assert not bsdf.is_specular_row(material_row(Glass(roughness=0.005), BAND_CENTRES_NM))


def test_a_medium_is_interpolated_between_the_bands():
    wax = Subsurface(mean_free_path=(2e-3, 1e-3, 0.5e-3), scattering_albedo=(0.9, 0.8, 0.7), anisotropy=0.3)
    row = material_row(wax, BAND_CENTRES_NM)
    assert row[bsdf.EXTINCTION : bsdf.EXTINCTION + 3] == pytest.approx([500, 1000, 2000])
    assert row[bsdf.SCATTERED : bsdf.SCATTERED + 3] == pytest.approx([0.9, 0.8, 0.7])
    assert row[bsdf.ANISOTROPY] == 0.3
    middle = material_row(wax, (0.5 * (BAND_CENTRES_NM[0] + BAND_CENTRES_NM[1]),) * 3)
    assert middle[bsdf.EXTINCTION] == pytest.approx(1 / 1.5e-3) and middle[bsdf.SCATTERED] == pytest.approx(0.85)


def test_an_emitter_shines_to_its_front_alone():
    row, rgb = material_row(Emitter(radiance=(1.0, 2.0, 3.0)), BAND_CENTRES_NM), np.empty(3)
    emission(row, 0.5, rgb)
    assert rgb.tolist() == [1.0, 2.0, 3.0]
    emission(row, -0.5, rgb)
    assert rgb.tolist() == [0.0, 0.0, 0.0]
