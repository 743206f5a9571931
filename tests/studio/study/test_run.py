"""A study gives the same table however it is run: at once, resumed, in shards, by several processes."""

from __future__ import annotations

import json
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pyarrow.parquet
import pytest
from click.testing import CliRunner

import main
import studio.runtime.workers
from render.base.errors import Cancelled, InputError
from studio.runtime.workers import Engine
from studio.study.answers import answers
from studio.study.begin import begin
from studio.study.cells import Shard
from studio.study.page import write_page
from studio.study.runner import run_study
from studio.study.store import FILE, Store, described
from studio.study.study import Study
from studio.study.tables import write_tables

ROOT = Path(__file__).resolve().parents[3]
HERE = Engine(workers=1)
DATA: dict[str, Any] = {
    "name": "small",
    "base": "plane",
    "image_scale": 0.05,
    "repeats": 3,
    "methods": ["likelihood", "centre_of_mass"],
    # for the image: how a pixel moves the line takes far longer than all else here, and no answer depends on it
    "set": {
        "render.transport": "direct",
        "render.laser_error": 0.05,
        "render.ambient_samples": 1,
        "render.goal": None,
    },
    "sweeps": [
        {
            "name": "starved",
            "vary": [{"field": "sensor.exposure_time", "low": 0.02, "high": 1e-7, "spacing": "logarithmic"}],
            "sampling": "bisection",
            "tolerance": 0.05,
            "measure": "completeness",
            "limit": {"measure": "completeness", "value": 0.9, "above": False},
        },
        {
            "name": "noise",
            "vary": [{"field": "sensor.read_noise", "values": [1.0, 100.0]}],
            "chart": "speed",
            "measure": "depth_rmse",
        },
    ],
}


def study() -> Study:
    return Study.model_validate(DATA)


def table(folder: Path, store: Store) -> bytes:
    chosen = study()
    return write_tables(folder, chosen, chosen.bases(folder), store.rows())[0].read_bytes()


def run(folder: Path, **options: Any) -> bytes:
    folder.mkdir(exist_ok=True)
    chosen = study()
    bases = chosen.bases(folder)
    with Store(folder, chosen.digest(bases)) as store:
        store.describe(chosen, bases)
        run_study(chosen, bases, store, **{"engine": HERE, **options})
        return table(folder, store)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, bytes]:
    folder = tmp_path_factory.mktemp("whole")
    return folder, run(folder)


def test_a_bisection_finds_where_light_runs_out_and_says_so(whole: tuple[Path, bytes]) -> None:
    chosen, bases = described(whole[0])
    with Store(whole[0], chosen.digest(bases)) as store:
        starved, noise = answers(chosen, bases, store.rows())
    assert [one.method for one in starved.broken] == ["likelihood", "centre_of_mass"]
    for one in starved.broken:
        assert one.breakdown.ending == "found" and one.cause == "starved"
        assert 1e-7 < one.breakdown.low <= one.breakdown.value <= one.breakdown.high < 0.02
    # more read noise, more error
    likelihood = [spot for spot in noise.spots if spot.method == "likelihood"]
    assert likelihood[0].measure.high < likelihood[1].measure.low


def test_parquet_and_csv_hold_the_same_table(whole: tuple[Path, bytes]) -> None:
    found = pyarrow.parquet.read_table(whole[0] / "table.parquet")
    lines = whole[1].decode().splitlines()
    assert len(lines) == found.num_rows + 1
    assert lines[0].replace('"', "").split(",") == found.column_names
    assert not any("seconds" in name for name in found.column_names)


def test_a_study_that_is_stopped_anywhere_goes_on_to_the_same_table(whole: tuple[Path, bytes], tmp_path: Path) -> None:
    chance, stops, patience = random.Random(1), 0, 0

    def impatient() -> bool:
        nonlocal patience
        patience -= 1
        return patience < 0

    for attempt in range(100):
        patience = chance.randrange(15 * (attempt + 1))  # looks, of which a render takes many
        try:
            again = run(tmp_path, cancelled=impatient)
            break
        except Cancelled:
            stops += 1
    assert again == whole[1] and stops > 2


@pytest.mark.validation
def test_three_shards_merged_give_the_same_table(whole: tuple[Path, bytes], tmp_path: Path) -> None:
    chosen = study()
    digest = chosen.digest(chosen.bases(tmp_path))
    (tmp_path / "merged").mkdir()
    counts = []
    with Store(tmp_path / "merged", digest) as store:
        for number in (1, 2, 3):
            run(tmp_path / f"shard{number}", shard=Shard(number, 3))
            counts.append(store.merge(tmp_path / f"shard{number}", digest))
        assert table(tmp_path / "merged", store) == whole[1]
        assert store.merge(tmp_path / "shard1", digest) == 0
    assert sum(count > 0 for count in counts) >= 2


def test_two_processes_give_the_same_table(whole: tuple[Path, bytes], tmp_path: Path) -> None:
    assert run(tmp_path / "two", engine=Engine(workers=2)) == whole[1]


def test_a_worker_that_dies_again_and_again_is_told_and_what_was_measured_is_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from concurrent.futures import Future
    from concurrent.futures.process import BrokenProcessPool

    done = 0

    def lost(work: Any, cancelled: Any, task: Any) -> Future[Any]:
        nonlocal done
        done += 1
        if done <= 2:
            return here(work, cancelled, task)
        future: Future[Any] = Future()
        future.set_exception(BrokenProcessPool("a worker was killed"))
        return future

    here = studio.runtime.workers._here
    monkeypatch.setattr(studio.runtime.workers, "_here", lost)
    with pytest.raises(InputError, match="workers of the study end before their work is done"):
        run(tmp_path)
    chosen, bases = described(tmp_path)
    with Store(tmp_path, chosen.digest(bases)) as store:
        assert store.count() > 0


def test_a_project_in_which_nothing_can_be_seen_is_a_row_with_its_reason(tmp_path: Path) -> None:
    data = {**DATA, "sweeps": [{"name": "away", "vary": [{"field": "scene.objects[0].visible", "values": [False]}]}]}
    chosen = Study.model_validate(data)
    bases = chosen.bases(tmp_path)
    with Store(tmp_path, chosen.digest(bases)) as store:
        run_study(chosen, bases, store, engine=HERE)
        rows = list(store.rows().values())
        write_page(tmp_path, chosen, bases, store.rows())
    assert len(rows) == 6 and all(row["reason"] or row["completeness"] != row["completeness"] for row in rows)


def test_the_folder_of_another_study_is_refused_and_stays_as_it_was(whole: tuple[Path, bytes]) -> None:
    before = (whole[0] / FILE).read_bytes()
    with pytest.raises(InputError, match="another study"):
        Store(whole[0], "0" * 64)
    assert (whole[0] / FILE).read_bytes() == before


def test_rows_of_another_version_of_the_program_are_not_added_to_and_can_still_be_looked_at(
    whole: tuple[Path, bytes], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("studio.study.study.program_digest", lambda: "another")
    with pytest.raises(InputError, match="program differ"):
        run(whole[0])
    with Store(whole[0], None) as store:
        assert table(whole[0], store) == whole[1]


@pytest.mark.parametrize("content", [b"no database" * 100, b""])
def test_a_damaged_store_is_told(tmp_path: Path, content: bytes) -> None:
    (tmp_path / FILE).write_bytes(content)
    with pytest.raises(InputError, match=r"study\.sqlite"):
        described(tmp_path)


def test_a_full_disk_harms_no_cell_that_is_there_and_the_study_goes_on_once_there_is_room(
    whole: tuple[Path, bytes], tmp_path: Path
) -> None:
    chosen = study()
    bases = chosen.bases(tmp_path)
    digest = chosen.digest(bases)
    with Store(whole[0], None) as store:
        rows = store.rows()
    with Store(tmp_path, digest) as store:
        store.add([(key, row, {}) for key, row in list(rows.items())[:10]])
        (pages,) = store._connection.execute("PRAGMA page_count").fetchone()
        store._connection.execute(f"PRAGMA max_page_count = {pages}")  # which to SQLite is a full disk
        message = r"study\.sqlite: there is no room for the file"
        with pytest.raises(InputError, match=message):
            store.add([(key, row, {}) for key, row in rows.items()])
        with pytest.raises(InputError, match=message):
            store.merge(whole[0], digest)
        assert store.count() == 10
        store._connection.execute("PRAGMA max_page_count = 1000000")
        store.merge(whole[0], digest)
        assert table(tmp_path, store) == whole[1]


def test_a_disk_without_room_for_the_study_is_told_before_anything_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    chosen, out = study(), tmp_path / "out"
    monkeypatch.setattr("render.base.full_disk.free_bytes", lambda path: 100_000)
    bases = chosen.bases(tmp_path)
    with pytest.raises(InputError, match="no room for the study; found 100 kB free"), begin(out, chosen, bases, HERE):
        pass
    assert not out.exists()


def test_what_a_kill_left_half_written_goes_and_files_of_others_stay(tmp_path: Path) -> None:
    chosen, out = study(), tmp_path / "out"
    bases = chosen.bases(tmp_path)
    out.mkdir()
    left = [out / ".table.0123abcd.parquet", out / ".chart_1.0123abcd.png", out / ".bounds_2.0123abcd.csv"]
    kept = [out / ".notes.0123abcd.csv", out / "notes.csv"]
    for path in (*left, *kept):
        path.write_bytes(b"half")
    with begin(out, chosen, bases, HERE):
        assert not any(path.exists() for path in left)
    assert all(path.read_bytes() == b"half" for path in kept)


def command(*words: object) -> list[str]:
    """A study in a program of its own, which can be killed."""
    return [sys.executable, str(ROOT / "main.py"), "study", *map(str, words)]


@pytest.mark.validation
def test_a_killed_study_goes_on_with_nothing_lost_or_done_twice(whole: tuple[Path, bytes], tmp_path: Path) -> None:
    file, out = tmp_path / "study.json", tmp_path / "out"
    file.write_text(json.dumps(DATA))
    run_it = command("run", file, "--out", out, "--workers", "2", "--json")
    process = subprocess.Popen(run_it, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True)
    chosen = study()
    deadline = time.monotonic() + 300.0
    while time.monotonic() < deadline:
        if (out / FILE).exists():
            with Store(out, chosen.digest(chosen.bases(tmp_path))) as store:
                if store.count() > 0:
                    break
        time.sleep(0.05)
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    done = subprocess.run(run_it, capture_output=True, text=True, timeout=600)
    answer = json.loads(done.stdout)
    assert done.returncode == 0 and answer["missing"] == 0
    assert (out / "table.csv").read_bytes() == whole[1]
    assert (out / "study.html").read_text().count("data:image/png") == 2


def test_show_tells_what_a_folder_holds(whole: tuple[Path, bytes]) -> None:
    done = CliRunner().invoke(main.cli, ["study", "show", str(whole[0])])
    assert done.exit_code == 0 and "below that, starved" in " ".join(done.stdout.split())


def test_a_folder_without_a_study_is_told(tmp_path: Path) -> None:
    done = CliRunner().invoke(main.cli, ["study", "show", str(tmp_path)])
    assert done.exit_code == 2 and "the folder holds no study" in done.stderr


def test_a_render_under_way_is_given_up_where_the_study_is_stopped(tmp_path: Path) -> None:
    """Not only between two renders, of which each may take minutes."""
    asked = 0

    def at_the_second_look() -> bool:
        nonlocal asked
        asked += 1
        return asked > 1

    with pytest.raises(Cancelled):
        run(tmp_path, cancelled=at_the_second_look)
    with Store(tmp_path, None) as store:
        assert asked > 1 and store.count() == 0
