"""A search renders each seed once, however many steps it takes, and finds what it would find without."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from studio.study import measuring
from studio.study.runner import run_study
from studio.study.store import Store
from studio.study.study import Study
from tests.studio.study.test_run import DATA, HERE


def measured(folder: Path, sweep: dict[str, Any]) -> dict[str, float]:
    folder.mkdir()
    study = Study.model_validate({**DATA, "sweeps": [sweep]})
    bases = study.bases(folder)
    with Store(folder, study.digest(bases)) as store:
        run_study(study, bases, store, engine=HERE)
        return {key: row["completeness"] for key, row in store.rows().items()}


def test_the_steps_of_a_search_share_their_renders(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[int] = []
    render = measuring.render

    def counted(project: Any, **options: Any) -> Any:
        made.append(project.seed)
        return render(project, **options)

    monkeypatch.setattr(measuring, "render", counted)
    monkeypatch.setattr(measuring, "warm_up", lambda project, methods: measuring.forget())
    search = DATA["sweeps"][0]
    found = measured(tmp_path / "with", search)
    assert len(made) == len(set(made)) == DATA["repeats"] and len(found) > 6 * len(made)
    monkeypatch.setattr(measuring, "rendered", lambda key, make: make())
    assert measured(tmp_path / "without", search) == found and len(made) > 3 * DATA["repeats"]


def test_no_more_is_kept_than_allowed(monkeypatch: pytest.MonkeyPatch) -> None:
    from studio.study import render_cache

    monkeypatch.setattr(render_cache, "_size", lambda kept: 1)
    monkeypatch.setattr(render_cache, "MOST_BYTES", 2)
    render_cache.forget()
    for key in "abca":
        render_cache.rendered(key, lambda: (object(), 0.0))  # type: ignore[arg-type,return-value]
    assert list(render_cache._frames) == ["c", "a"]
    render_cache.forget()
