"""The table in the head of each model's file says of every parameter what the model itself says."""

import inspect
import re
import sys
from typing import get_args

import pytest

from render.material.material import BaseMaterial

MODELS = get_args(get_args(BaseMaterial)[0])
WORDS = {
    "Texture": "image",
    "GreyTexture": "image",
    "FromMesh": "from mesh",
    "NormalMap": "normal map",
    "BumpMap": "bump map",
}


def described(model):
    """name -> (unit, range) of the rows of a table, whose columns are two spaces apart."""
    head, *rows = re.findall(r"^    (\S.*)$", inspect.getdoc(sys.modules[model.__module__]), re.MULTILINE)
    assert head.split() == ["parameter", "unit", "range", "what", "it", "is"]
    cells = [re.split(r" {2,}", row) for row in rows]
    assert all(len(cell) == 4 for cell in cells), cells
    return {name: (unit, limits) for name, unit, limits, _ in cells}


def allowed(field):
    """What a field's schema allows, as (numbers it lies between, words for whatever is no number)."""
    limits, words = set(), set()
    for one in field.get("anyOf", [field]):
        if "prefixItems" in one:
            words.add("RGB")
        for number in one.get("prefixItems", [one]):
            if "minimum" in number:
                limits.add((number["minimum"], number["maximum"]))
        for name in re.findall(r"#/\$defs/(\w+)", str(one)):
            words.add(WORDS[name])
        if one.get("type") == "null":
            words.add("none")
    return limits, words


@pytest.mark.parametrize("model", MODELS, ids=lambda model: model.__name__)
def test_the_table_of_a_material_is_that_of_its_model(model):
    table, fields = described(model), model.model_json_schema()["properties"]
    assert list(table) == [name for name in fields if name != "kind"]
    for name, (unit, text) in table.items():
        limits, words = allowed(fields[name])
        assert unit == (fields[name]["unit"] or "-"), name
        found = {(float(low), float(high)) for low, high in re.findall(r"([-\d.e]+) to ([-\d.e]+)", text)}
        assert found == limits, name
        if "enum" not in fields[name]:
            assert {part.strip() for part in text.split(",") if " to " not in part} == words, name
