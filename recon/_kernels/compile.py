"""How every kernel is compiled: one decorator, one cache that never serves stale code.

numba's on-disk cache does not notice edits in imported jitted modules. So each source file gets a cache folder of its own,
named after a hash of that file and of all kernel files that it imports, directly or not. Kernels are compiled on first
use, never at import; the first compilation of a process says so in one line on stderr.
"""

from __future__ import annotations

import hashlib
import os
import re
import sys
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import Any, Literal

import numba
from numba.core import config as numba_config
from numba.core import event
from numba.core.compiler_lock import global_compiler_lock
from numba.misc.appdirs import AppDirs

config: Any = numba_config  # filled at run time
HERE = Path(__file__).resolve().parent
_KERNEL_IMPORT = re.compile(r"^\s*from (\.|recon\._kernels\.)(\w+) import", re.MULTILINE)
_OURS: set[int] = set()  # ids of our dispatchers, which live as long as the process


def kernel(function: Callable | None = None, *, inline: Literal["never", "always", "late"] = "never") -> Any:
    """Compile a function to machine code on first use (numba), without the interpreter lock, exact arithmetic untouched.

    Parameters
    ----------
    function : callable
    inline : {"never", "always", "late"}
        "always" pastes the body into the caller: for what must see an array inside a hot loop. "late" does so after
        numba is done with it: for arithmetic without a return or a short circuit on the way, whose loops become vector
        instructions.

    Returns
    -------
    The compiled dispatcher; the plain function where ``NUMBA_DISABLE_JIT`` is set.

    Notes
    -----
    No ``fastmath``, ever: it breaks error-free arithmetic. Division by zero gives inf or NaN, as in numpy.
    """
    if function is None:
        return lambda f: kernel(f, inline=inline)
    if config.DISABLE_JIT:
        return function
    folder = _cache_folder(Path(function.__code__.co_filename))
    with global_compiler_lock:  # the setting is the whole process's: ours for this one statement only
        theirs, config.CACHE_DIR = config.CACHE_DIR, str(folder or "")
        try:
            compiled = numba.njit(
                function,
                nogil=True,
                inline="always" if inline == "always" else "never",
                forceinline=inline == "late",
                error_model="numpy",
                cache=folder is not None and inline == "never",
            )
        finally:
            config.CACHE_DIR = theirs
    _OURS.add(id(compiled))
    return compiled


@lru_cache
def _cache_folder(source: Path) -> Path | None:
    """Folder for the machine code of one source file, made and writable; None where there is none (then nothing is kept)."""
    digest = hashlib.sha256()
    for path in sorted({Path(__file__).resolve(), *_sources(source.resolve(), set())}):
        digest.update(path.read_bytes())
    digest.update(f"{numba.__version__} {config.BOUNDSCHECK} {config.OPT}".encode())  # not in numba's own key
    root = Path(config.CACHE_DIR or AppDirs(appname="recon", appauthor=False).user_cache_dir)
    folder = root / f"kernels-{_version()}-{source.stem}-{digest.hexdigest()[:16]}"
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return None
    return folder if os.access(folder, os.W_OK) else None


def _sources(source: Path, known: set[Path]) -> set[Path]:
    """Collect a kernel file and the kernel files that it imports, transitively."""
    if source in known or not source.is_file():
        return known
    known.add(source)
    for dots, name in _KERNEL_IMPORT.findall(source.read_text(encoding="utf-8")):
        _sources((source.parent if dots == "." else HERE) / f"{name}.py", known)
    return known


def _version() -> str:
    from recon import __version__

    return __version__


class _Announcer(event.Listener):
    """Say once a process, on stderr, that kernels are being compiled: loading them from the cache is silent."""

    def __init__(self) -> None:
        self.said = False

    def on_start(self, event: event.Event) -> None:
        if self.said or id(event.data["dispatcher"]) not in _OURS:
            return
        self.said = True
        sys.stderr.write("recon: compiling kernels for this machine, first use only (up to a minute) ...\n")
        sys.stderr.flush()

    def on_end(self, event: event.Event) -> None:
        pass


event.register("numba:compile", _Announcer())
