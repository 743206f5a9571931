"""A message is one message, whatever a file is called."""

from __future__ import annotations

from render.base.errors import InputError


def test_a_name_with_a_line_end_does_not_begin_a_line_of_its_own() -> None:
    error = InputError("there is no such file", where="scan/a\nerror: b", cure="give another")
    assert str(error) == "scan/a\\nerror: b: there is no such file; give another"
    assert error.where == "scan/a\nerror: b"
