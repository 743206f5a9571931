"""What `main.py study` does: list, run, show and merge studies."""

from __future__ import annotations

import re
import sys
import textwrap
import threading
from pathlib import Path

from render.base.errors import Cancelled, InputError
from studio.commands.places import check_output, folder_name, never
from studio.project.project import Project
from studio.runtime.console import print_table, stage_progress
from studio.runtime.streams import print_json
from studio.runtime.workers import Engine
from studio.scan.folder_lock import hold
from studio.scan.interrupt import stop_on_interrupt
from studio.study.as_begun import begun_in
from studio.study.begin import begin
from studio.study.cells import Shard, next_cells
from studio.study.labels import as_read
from studio.study.one_phase import one_phase_doubts
from studio.study.runner import run_study
from studio.study.store import Store, described
from studio.study.study import SEARCHES, Study, ready_made
from studio.study.tasks import tasks


def list_studies(*, quiet: bool, as_json: bool) -> None:
    """`study list`: the ready-made studies."""
    found = {name: Study.load(name)[0] for name in ready_made()}
    if as_json:
        print_json({"ok": True, "studies": {name: one.question for name, one in found.items()}})
        return
    print_table("Ready-made studies", [(name, one.question) for name, one in found.items()])
    if not quiet:
        print("\nnext: python main.py study run quick --out scan-output/quick")


def run_file(
    file: Path, *, out: Path | None, workers: int | None, scheduler: str | None, shard: str, quiet: bool, as_json: bool
) -> None:
    """`study run`: measure what is missing, then write tables, charts and page."""
    study, root = Study.load(file)
    part, bases = shard_of(shard), study.bases(root)
    folder = out if out is not None else Path("scan-output") / f"study-{folder_name(study.name)}"
    run_into(folder, study, bases, part, Engine(workers, scheduler), quiet=quiet, as_json=as_json)


def run_into(
    folder: Path, study: Study, bases: dict[str, Project], part: Shard, engine: Engine, *, quiet: bool, as_json: bool
) -> None:
    """Measure what is missing of a study in a folder, and write what it says so far."""
    check_output(folder)
    bases = begun_in(folder, study, bases)
    with begin(folder, study, bases, engine, part) as store:
        known = store.count()
        if not quiet:
            first = next_cells(study, bases, {}, part)
            renders = len(tasks(first, study.image_scale, study.laser))
            searches = sum(sweep.sampling in SEARCHES for sweep in study.sweeps)
            more = f", and what {searches} search(es) will ask for" if searches else ""
            there = f"; {known} are there already" if known else ""
            print(f"{len(first)} cells of {renders} renders{more}{there}", file=sys.stderr)
            for doubt in one_phase_doubts(study, bases):
                print(f"note: {doubt}", file=sys.stderr)
        threading.Thread(target=_import_page, name="import of charts").start()  # while the workers start and work
        with stage_progress(quiet) as progress, stop_on_interrupt(never) as cancelled:
            try:
                run_study(
                    study,
                    bases,
                    store,
                    engine=engine,
                    shard=part,
                    progress=lambda done, known, to_come: progress("cells", done / max(known + to_come, 1)),
                    cancelled=cancelled,
                )
            except Cancelled:
                raise Cancelled(f"{store.count()} cells are kept; the same command goes on from there") from None
        _write(folder, study, bases, store, as_json=as_json)


def show_folder(folder: Path, *, quiet: bool, as_json: bool) -> None:
    """`study show`: what a folder's study found so far; tables and charts are written anew."""
    study, bases = described(folder)
    with hold(folder), Store(folder, None) as store:
        _write(folder, study, bases, store, as_json=as_json)


def merge_folders(folders: tuple[Path, ...], *, out: Path, quiet: bool, as_json: bool) -> None:
    """`study merge`: the rows of several shards in one folder, as one run would have them."""
    study, bases = described(folders[0])
    check_output(out)
    digest = study.digest(bases)
    for folder in folders:
        described(folder)
        Store(folder, digest).close()  # refused before anything is written
    with hold(out), Store(out, digest) as store:
        store.describe(study, bases)
        for folder in folders:
            if folder.resolve() != out.resolve():
                store.merge(folder, digest)
        _write(out, study, bases, store, as_json=as_json)


def _import_page() -> None:
    import studio.study.page  # noqa: F401


def _write(folder: Path, study: Study, bases: dict[str, Project], store: Store, *, as_json: bool) -> None:
    from studio.study.page import sentences, write_page
    from studio.study.tables import write_tables

    rows = store.rows()
    written = write_tables(folder, study, bases, rows)
    page, found = write_page(folder, study, bases, rows)
    said = {answer.sweep.name: sentences(*as_read(answer, bases.values())) for answer in found}
    missing = len(next_cells(study, bases, rows))
    if as_json:
        files = [str(file) for file in (*written, page)]
        print_json({"ok": True, "folder": str(folder), "cells": len(rows), "missing": missing,
                    "files": files, "findings": said})  # fmt: skip
        return
    for name, lines in said.items():
        print(f"{name}:" if lines else f"{name}: charted")
        for line in lines:
            print(textwrap.fill(line, 110, initial_indent="  ", subsequent_indent="    "))
    left = f", {missing} still missing" if missing else ""
    print(f"{len(rows)} cells{left}\nwrote {page}\nwrote {written[0]}")


def shard_of(text: str) -> Shard:
    """The part of the work that `--shard 3/40` means. InputError: not like that."""
    found = re.fullmatch(r"(\d{1,6})/(\d{1,6})", text)
    number, count = (int(found[1]), int(found[2])) if found else (0, 0)
    if not 1 <= number <= count:
        raise InputError("this is no shard", where="--shard", found=text, allowed="1/3, 2/3 or 3/3, say")
    return Shard(number, count)
