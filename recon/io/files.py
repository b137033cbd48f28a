"""Bytes in and bytes out: whole files or standard streams, written whole or not at all."""

from __future__ import annotations

import contextlib
import os
import stat
import sys
import tempfile
import threading
from collections.abc import Iterator
from itertools import chain
from pathlib import Path
from typing import Any, BinaryIO

from numpy.typing import NDArray

from ..contracts import InvalidInput, shown

STREAM = "-"
_ROWS = 1 << 16
_unfinished: set[str] = set()  # files that are being written, under their temporary names
_lock = threading.Lock()  # held while one is made and noted


def as_path(path: Any) -> str:
    """Validate a path and give it as text.

    Raises
    ------
    InvalidInput
        What is none: no text, a null byte in it, bytes, or a number, which Python would take for that of an open file.
    """
    name = os.fspath(path) if isinstance(path, (str, os.PathLike)) else None
    if not isinstance(name, str):
        raise InvalidInput(f"path: expected a path, got {shown(path)}")
    if not name or "\0" in name:
        raise InvalidInput(f"path: {shown(name)} is no file name")
    return name


def display_name(path: str | os.PathLike[str], stream: str = "standard input") -> str:
    """Give what messages call a path: in one line, and in characters that can be written."""
    name = as_path(path)
    return stream if name == STREAM else name if name.isprintable() else ascii(name)[1:-1]


def read_bytes(path: str | os.PathLike[str]) -> bytes:
    """Read a whole file, or standard input for ``-``.

    Raises
    ------
    InvalidInput
        Missing, a folder, not readable, empty.
    """
    name = display_name(path)
    try:
        data = sys.stdin.buffer.read() if os.fspath(path) == STREAM else Path(path).read_bytes()
    except FileNotFoundError as error:
        raise InvalidInput(f"{name}: no such file") from error
    except IsADirectoryError as error:
        raise InvalidInput(f"{name}: is a folder, a file was expected") from error
    except (OSError, ValueError) as error:
        raise InvalidInput(f"{name}: cannot be read ({_reason(error)})") from error
    if not data:
        raise InvalidInput(f"{name}: is empty")
    return data


def check_writable(path: str | os.PathLike[str]) -> None:
    """See that a file can be written, before the work that it is to hold.

    Raises
    ------
    InvalidInput
        A folder, in a folder that does not exist or where nothing can be made, or a file that is write-protected.
    """
    if as_path(path) == STREAM:
        return
    name, target = display_name(path), os.path.realpath(path)
    folder = os.path.dirname(target)
    if os.path.isdir(target) or as_path(path).endswith(("/", os.sep)):
        raise InvalidInput(f"{name}: is a folder, name a file in it")
    if not os.path.isdir(folder):
        raise InvalidInput(f"{name}: cannot be written, there is no folder {display_name(folder)}")
    if os.path.exists(target) and not os.access(target, os.W_OK):
        raise InvalidInput(f"{name}: is write-protected")
    if _is_regular(target):
        try:
            handle, probe = _temporary(folder)
        except OSError as error:
            raise InvalidInput(f"{name}: cannot be written ({_reason(error)})") from error
        os.close(handle)
        _discard(probe)


@contextlib.contextmanager
def whole_file(path: str | os.PathLike[str]) -> Iterator[BinaryIO]:
    """Open a file that appears under its name only when it is complete.

    It is written beside its place under another name, flushed to disk and renamed; whatever stops the writing, Ctrl-C
    too, leaves nothing behind and an older file as it was. ``-`` is standard output; devices and pipes are written
    directly.

    Raises
    ------
    InvalidInput
        The file cannot be written.
    """
    if as_path(path) == STREAM or not _is_regular(os.path.realpath(path)):
        with _directly(path) as file:
            yield file
        return
    target = os.path.realpath(path)
    check_writable(path)
    handle, temporary = _temporary(os.path.dirname(target))
    try:
        with os.fdopen(handle, "wb") as file:
            yield file
            file.flush()
            os.fsync(file.fileno())
        os.chmod(temporary, _mode(target))
        os.replace(temporary, target)
        _unfinished.discard(temporary)
    except OSError as error:
        _discard(temporary)
        raise InvalidInput(f"{display_name(path)}: cannot be written ({_reason(error)})") from error
    except BaseException:
        _discard(temporary)
        raise


def write_rows(file: BinaryIO, pattern: str, *tables: NDArray) -> None:
    """Print the rows of tables (n, k), side by side, by a pattern; a block at a time, as Python's numbers take much room."""
    for begin in range(0, len(tables[0]), _ROWS):
        rows = zip(*(table[begin : begin + _ROWS].tolist() for table in tables))
        file.write("".join([pattern % tuple(chain.from_iterable(row)) for row in rows]).encode())


@contextlib.contextmanager
def _directly(path: str | os.PathLike[str]) -> Iterator[BinaryIO]:
    """Open a device, a pipe or standard output."""
    try:
        if os.fspath(path) == STREAM:
            yield sys.stdout.buffer
            sys.stdout.buffer.flush()
        else:
            with open(path, "wb") as file:
                yield file
    except BrokenPipeError:
        raise
    except OSError as error:
        raise InvalidInput(f"{display_name(path, 'standard output')}: cannot be written ({_reason(error)})") from error


def discard_unfinished() -> None:
    """Remove all that is half-written, and let nothing new be begun: the process must end after this."""
    _lock.acquire()
    for temporary in list(_unfinished):
        with contextlib.suppress(OSError):
            os.unlink(temporary)


def _temporary(folder: str) -> tuple[int, str]:
    with _lock:
        handle, temporary = tempfile.mkstemp(prefix=".recon-", suffix=".part", dir=folder)
        _unfinished.add(temporary)
    return handle, temporary


def _discard(temporary: str) -> None:
    with contextlib.suppress(FileNotFoundError):
        os.unlink(temporary)
    _unfinished.discard(temporary)


def _is_regular(target: str) -> bool:
    return not os.path.exists(target) or stat.S_ISREG(os.stat(target).st_mode)


def _mode(target: str) -> int:
    """Give the permissions of the file that is replaced, else those of any new file."""
    if os.path.exists(target):
        return stat.S_IMODE(os.stat(target).st_mode)
    mask = os.umask(0)
    os.umask(mask)
    return 0o666 & ~mask


def _reason(error: Exception) -> str:
    return getattr(error, "strerror", None) or str(error)
