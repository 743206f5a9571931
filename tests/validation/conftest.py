"""A Dask cluster on this machine."""

from __future__ import annotations

from collections.abc import Iterator

import pytest


@pytest.fixture
def scheduler() -> Iterator[str]:
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as local:
        yield local.scheduler_address
