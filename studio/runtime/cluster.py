"""A Dask cluster by its scheduler's address; needs the extra `cluster` (dask.distributed)."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from typing import Any

from render.base.errors import InputError
from render.run import never

PATIENCE = "20s"


def check_answers(address: str) -> None:
    """InputError: dask.distributed is not installed, or no scheduler answers."""
    _client(address).close()


@contextmanager
def cluster(address: str, work: Callable[..., Any]) -> Iterator[tuple[Callable[[Any], Future[Any]], int]]:
    """How to hand a task of `work` to the cluster, and how many at a time.

    Workers find meshes and textures at the paths of this machine: a folder that all share.
    InputError: as `check_answers`.
    """
    client = _client(address)
    try:
        threads = sum(worker["nthreads"] for worker in client.scheduler_info(n_workers=-1)["workers"].values())
        with client.get_executor(pure=False, retries=2) as executor:

            def submit(task: Any) -> Future[Any]:
                return executor.submit(work, task, never)  # type: ignore[no-any-return]

            yield submit, max(2 * threads, 2)
    finally:
        client.close()


def _client(address: str) -> Any:
    """Of the cluster; Dask's own configuration, TLS included, holds. InputError: as `check_answers`."""
    try:
        from distributed import Client
    except ModuleNotFoundError:
        cure = 'install it: pip install "blazer-studio[cluster]"'
        raise InputError("dask.distributed is not installed", where="--scheduler", cure=cure) from None
    try:
        return Client(address, timeout=PATIENCE)
    except (OSError, ValueError, TimeoutError) as error:
        raise InputError(
            "no Dask scheduler answers",
            where="--scheduler",
            found=f"{address} ({type(error).__name__})",
            allowed="tcp://HOST:PORT or tls://HOST:PORT of a running one",
            cure="start one: dask scheduler",
        ) from None
