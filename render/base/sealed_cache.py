"""Cached kernels with a checksum: a damaged file, or a full disk, costs a compilation instead of stopping the program.

Numba trusts its cache: a damaged file stops the program (EOFError, or LLVM ends the process), and so does a folder that
cannot be written. Here each file ends in a checksum (seal), which unpickling ignores; a file that fails it is treated
as missing.
"""

from __future__ import annotations

import hashlib
import os
import pickle
import warnings
from contextlib import suppress
from typing import Any

import numba
from numba.core import caching

from render.base.kernel_cache import CALLEE, ROOMS, ROOT, hands_over, kept_in

SEAL_BYTES = 16
ROOM_PATHS = tuple(os.path.join(ROOT, room, "") for room in ROOMS)


def cache_of(kernel: Any) -> caching.FunctionCache:
    """The cache of a Python function: a sealed one for a kernel of this program, numba's own for any other."""
    ours = os.path.abspath(kernel.__code__.co_filename).startswith(ROOM_PATHS)
    return (KernelCache if ours else caching.FunctionCache)(kernel)


class Locator(caching.UserProvidedCacheLocator):
    """The folder of the kernels, whether or not it can be written."""

    def __init__(self, kernel: Any, source: str) -> None:
        super().__init__(kernel, source)
        self._cache_path = os.path.join(kept_in(), self.get_suitable_cache_subpath(source))

    @classmethod
    def from_function(cls, kernel: Any, source: str) -> Locator:
        return cls(kernel, source)


class KernelImplementation(caching.CompileResultCacheImpl):
    _locator_classes = (Locator,)


class SealedFiles(caching.IndexDataCacheFile):
    """The index and the machine code of one kernel."""

    def save(self, key: Any, data: Any) -> None:
        super().save(key, (key, data))

    def load(self, key: Any) -> Any:
        """The data, or None. Two processes that save at once may give two keys one file: it says whose it is."""
        try:
            found = super().load(key)
        except Exception:  # of unpickling: what another version of some library wrote
            return None
        return found[1] if found is not None and found[0] == key else None

    def save_callee(self, key: Any, data: Any) -> None:
        """In a file of its own, without an index."""
        key = self._index_name, key
        self._write(self._callee_path(key), self._dump((key, data)))

    def load_callee(self, key: Any) -> Any:
        """What `save_callee` has written, or None."""
        key = self._index_name, key
        try:
            with open(self._callee_path(key), "rb") as file:
                stored, data = pickle.loads(_unsealed(file.name, file.read()))
        except Exception:  # of reading and of unpickling
            return None
        return data if stored == key else None

    def _callee_path(self, key: Any) -> str:
        digest = hashlib.blake2b(repr(key).encode(), digest_size=SEAL_BYTES)
        return os.path.join(self._cache_path, digest.hexdigest() + CALLEE)

    def _load_index(self) -> dict[Any, str]:
        try:
            self._check(self._index_path)
        except OSError:
            return {}
        return dict(super()._load_index())

    def _save_index(self, overloads: dict[Any, str]) -> None:
        version, content = pickle.dumps(self._version, protocol=-1), self._dump((self._source_stamp, overloads))
        self._write(self._index_path, version + content)

    def _load_data(self, name: str) -> Any:
        self._check(self._data_path(name))
        return super()._load_data(name)

    def _save_data(self, name: str, data: Any) -> None:
        self._write(self._data_path(name), self._dump(data))

    def _write(self, path: str, content: bytes) -> None:
        with self._open_for_write(path) as file:
            file.write(content + _seal(path, content))

    def _check(self, path: str) -> None:
        """OSError: the file is missing, cannot be read or is not as it was written."""
        with open(path, "rb") as file:
            _unsealed(path, file.read())


class KernelCache(caching.FunctionCache):
    """The cache of one kernel; files that cannot be read or written are no error."""

    _impl_class = KernelImplementation
    _warned = False

    def __init__(self, kernel: Any) -> None:
        super().__init__(kernel)
        stamp = self._impl.locator.get_source_stamp()
        self._cache_file: Any = SealedFiles(self._cache_path, self._impl.filename_base, stamp)

    def hand_over(self, signature: Any, codegen: Any, data: Any) -> None:
        """Leave what kernels call to a process that compiles at the same time; without files that does it itself."""
        if hands_over():
            with suppress(OSError):
                self._impl.locator.ensure_cache_path()
                self._cache_file.save_callee(self._index_key(signature, codegen), data)

    def handed_over(self, signature: Any, codegen: Any) -> Any:
        """What another process has left; None: nothing."""
        return self._cache_file.load_callee(self._index_key(signature, codegen)) if hands_over() else None

    def save_overload(self, signature: Any, data: Any) -> None:
        try:
            super().save_overload(signature, data)
        except OSError as error:
            if not KernelCache._warned:
                KernelCache._warned = True
                reason = f"{error.strerror or error}; they are compiled anew at the next start"
                warnings.warn(f"compiled kernels cannot be kept in {kept_in()}: {reason}", UserWarning, stacklevel=2)


def _unsealed(path: str, data: bytes) -> bytes:
    """The content of a file of that name; OSError: it is not as it was written."""
    content = data[:-SEAL_BYTES]
    if data[-SEAL_BYTES:] != _seal(path, content):
        raise OSError(f"{path} is damaged")
    return content


def _seal(path: str, content: bytes) -> bytes:
    """The checksum of the content of a file of that name, 16 bytes."""
    digest = hashlib.blake2b(f"{numba.__version__} {os.path.basename(path)}\0".encode(), digest_size=SEAL_BYTES)
    digest.update(content)
    return digest.digest()
