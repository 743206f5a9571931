"""The recipe of a dataset: a base project, what is drawn for every scene and for every image, and what is kept."""

from __future__ import annotations

import hashlib
import json
import math
from pathlib import Path
from typing import Any, Literal, Self

from pydantic import Field, model_validator

from render.base.errors import InputError
from render.base.model import Model, quantity
from studio.project.project import Project
from studio.project.ready_made import load_model, names_in
from studio.project.templates import DESCRIPTIONS, template_folder

FOLDER = Path(__file__).resolve().parents[2] / "assets" / "recipes"
MESHES = (".glb", ".gltf", ".obj", ".off", ".ply", ".stl")
MOST_DRAWS, MOST_VALUES, MOST_VARIANTS = 200, 10_000, 100
OF_IMAGES = ("sensor.",)
"""Fields that an image may have of its own, as its scene's light does not depend on them."""
Value = bool | int | float | str | None | dict[str, Any] | list[Any]


class Draw(Model):
    """A field of the project and the distribution that its value is drawn from."""

    field: str = quantity(label="Field", help="Path in the project file: sensor.exposure_time.", max_length=200)
    kind: Literal["uniform", "logarithmic", "normal", "integer", "choice", "mesh"] = "uniform"
    low: float | None = quantity(None, label="From")
    high: float | None = quantity(None, label="To")
    mean: float | None = quantity(None, label="Mean", help="Of normal.")
    sigma: float | None = quantity(None, label="Standard deviation", help="Of normal, cut off at low and high.", gt=0)
    values: tuple[Value, ...] = Field(default=(), description="Of choice, each as likely.", max_length=MOST_VALUES)
    folder: str | None = quantity(None, label="Folder", help="Of mesh: beside the recipe.", max_length=1000)
    unit: Literal["m", "cm", "mm", "um", "in"] = quantity("m", label="Unit of the meshes")

    @model_validator(mode="after")
    def _is_whole(self) -> Self:
        ranged = self.kind in ("uniform", "logarithmic", "normal", "integer")
        if ranged:
            if self.low is None or self.high is None or not self.low < self.high:
                raise ValueError(f"{self.field} is drawn from {self.low} to {self.high}; allowed: low below high")
            if self.kind == "logarithmic" and self.low <= 0.0:
                raise ValueError(f"{self.field}: a logarithmic range reaches 0; allowed: low above 0")
            if self.kind == "integer" and not (self.low.is_integer() and self.high.is_integer()):
                raise ValueError("an integer is drawn between integers; allowed: whole numbers for low and high")
            if self.kind == "normal":
                if self.mean is None or self.sigma is None:
                    raise ValueError("normal has no mean or sigma; allowed: both")
                if self._mass()[1] - self._mass()[0] < 1e-6:
                    raise ValueError("low to high lies too far out of the distribution; allowed: a part of 1e-6 of it")
        if self.kind == "choice" and not self.values:
            raise ValueError("choice has nothing to choose from; allowed: values")
        if self.kind == "mesh" and self.folder is None:
            raise ValueError("mesh has no folder; allowed: a folder of meshes beside the recipe")
        return self

    @property
    def of_images(self) -> bool:
        """Drawn for each image of a scene, and not once for the scene."""
        return self.field.startswith(OF_IMAGES)

    def _mass(self) -> tuple[float, float]:
        from scipy.special import ndtr

        assert self.low is not None and self.high is not None and self.mean is not None and self.sigma is not None
        return float(ndtr((self.low - self.mean) / self.sigma)), float(ndtr((self.high - self.mean) / self.sigma))

    def at(self, place: float) -> Value:
        """The value at a place in [0, 1): the inverse of the distribution function. Not of mesh."""
        if self.kind == "choice":
            return self.values[int(place * len(self.values))]
        assert self.low is not None and self.high is not None
        if self.kind == "logarithmic":
            return float(self.low * (self.high / self.low) ** place)
        if self.kind == "integer":
            return int(self.low) + int(place * (int(self.high) - int(self.low) + 1))
        if self.kind == "normal":
            from scipy.special import ndtri

            low, high = self._mass()
            assert self.mean is not None and self.sigma is not None
            value = self.mean + self.sigma * float(ndtri(low + place * (high - low)))
            return float(min(max(value, self.low), self.high))
        return self.low + place * (self.high - self.low)


class Recipe(Model):
    """Frozen; what a file leaves out takes the defaults, and what it should not hold is refused."""

    schema_version: Literal[1] = 1
    name: str = quantity("dataset", label="Name", min_length=1, max_length=100)
    about: str = quantity("", label="About", help="For the data card.", max_length=2000)
    base: str = quantity(label="Base project", help="A template's name, or a path beside the recipe.")
    image_scale: float = quantity(1.0, label="Image scale", ge=0.01, le=4.0)
    seed: int = quantity(0, label="Seed", help="Decides every scene and every image.", ge=0, le=2**53 - 1)
    images: int = quantity(1, label="Images of each scene", help="With draws of their own of the sensor.", ge=1,
                           le=MOST_VARIANTS)  # fmt: skip
    lasers: Literal["together", "in turn"] = quantity(
        "together", label="Lasers", help="together: all lines in one image. in turn: an image for each laser."
    )
    least_rows: float = quantity(
        0.05, label="Least line", help="Share of scan lines on which a line is to be seen; else it is drawn anew.",
        ge=0.0, le=1.0)  # fmt: skip
    maps: tuple[Literal["objects", "depth", "normals", "laser"], ...] = Field(
        default=("objects",), description="Labels of every pixel; laser: direct and reflected radiance of each."
    )
    split: tuple[float, float, float] = Field(
        default=(0.8, 0.1, 0.1), description="Shares of training, validation and test, by scene."
    )
    set: dict[str, Value] = Field(default_factory=dict, description="Fields of the project that are fixed.")
    draw: tuple[Draw, ...] = ()

    @model_validator(mode="after")
    def _fits(self) -> Self:
        if len(self.draw) > MOST_DRAWS:
            raise ValueError(f"{len(self.draw)} fields are drawn; allowed: at most {MOST_DRAWS}")
        fields = [one.field for one in self.draw]
        if len(set(fields)) < len(fields) or set(fields) & self.set.keys():
            raise ValueError("a field is there twice; allowed: each once in draw and set together")
        if any(share < 0.0 for share in self.split) or not math.isclose(sum(self.split), 1.0, abs_tol=1e-9):
            raise ValueError("the shares of split do not add up; allowed: three of at least 0, together 1")
        if len(set(self.maps)) < len(self.maps):
            raise ValueError("a map is there twice; allowed: each once")
        return self

    @classmethod
    def load(cls, path: Path | str) -> tuple[Self, Path]:
        """A recipe and the folder that its paths start from: `load_model`, with the ready-made ones of `FOLDER`."""
        return load_model(cls, path, FOLDER, "recipe")

    def digest(self, base: Project) -> str:
        """SHA-256 of what decides the images, beside the program."""
        said = {"recipe": self.model_dump(mode="json"), "base": base.model_dump(mode="json")}
        return hashlib.sha256(json.dumps(said, sort_keys=True).encode()).hexdigest()


def ready_made() -> list[str]:
    """Names of the recipes that come with the program."""
    return names_in(FOLDER)


def base_of(recipe: Recipe, root: Path) -> Project:
    """The recipe's base project with its fixed fields, in the folder that its files are in: its own, or the recipe's.

    Light is rendered to the errors of the image, as every image of a scene shares it and every pixel is a label.
    InputError: it cannot be read, a field does not fit, or drawn meshes are in another folder than its own files.
    """
    from render.base.files import inside
    from studio.project.project_files import named_files

    ready = recipe.base in DESCRIPTIONS
    base = Project.load(template_folder(recipe.base) if ready else inside(root, recipe.base, "base"))
    if ready and not named_files(base.scene, "scene"):
        base = base.in_folder(root)
    if any(one.kind == "mesh" for one in recipe.draw) and base.folder.resolve() != root.resolve():
        cure = "save the base project beside the recipe, with its files, and name that one"
        raise InputError(
            "the base project has files of its own, in another folder than the drawn meshes",
            where="base", found=recipe.base, allowed="a project beside the recipe", cure=cure,
        )  # fmt: skip
    return base.replaced({"render.goal": None, **recipe.set})
