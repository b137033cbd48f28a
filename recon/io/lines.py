"""Text files as tables of numbers: blank lines and comments skipped, the line of every row known."""

from __future__ import annotations

import io
from bisect import bisect_right
from collections.abc import Iterator
from itertools import chain, islice

import numpy as np
from numpy.typing import NDArray

from ..contracts import InvalidInput

_BLOCK = 1 << 16  # lines parsed at once: bounds the memory spent on Python strings
_UTF16 = (b"\xff\xfe", b"\xfe\xff")


class Lines:
    """The meaningful lines of a text file, read once from front to back.

    Parameters
    ----------
    data : bytes
    name : str
        What messages call the file.
    comments : tuple of str
        A line that starts with one of these is skipped; ``#`` also ends a line.
    first_line : int
        The number of the line that `data` begins with.

    Attributes
    ----------
    used : int
        Meaningful lines consumed so far.
    remarks : list of str
        The first few comment lines, without their mark.
    """

    def __init__(self, data: bytes, name: str, comments: tuple[str, ...] = ("#",), first_line: int = 1) -> None:
        if data[:2] in _UTF16:
            data = data.decode("utf-16", "replace").encode("utf-8")
        if data[:3] == b"\xef\xbb\xbf":
            data = data[3:]
        if b"\0" in data:
            raise InvalidInput(
                f"{name}: has binary data where text was expected; name its format (--from) if the file is sound"
            )
        self.name = name
        self.used = 0
        self._before = first_line - 1
        self.remarks: list[str] = []
        self._comments = comments
        self._skipped: list[int] = []
        self._stream = self._meaningful(io.TextIOWrapper(io.BytesIO(data), encoding="latin-1"))

    def _meaningful(self, file: io.TextIOWrapper) -> Iterator[str]:
        comments, skipped = self._comments, self._skipped
        inline = "#" in comments
        for number, raw in enumerate(file, 1):
            line = raw.strip()
            if line and not (comments and line.startswith(comments)):
                if inline and "#" in line:
                    line = line.split("#", 1)[0].rstrip()
                yield line
                continue
            skipped.append(number)
            if line and len(self.remarks) < 100:
                self.remarks.append(line.lstrip("".join(comments)).strip())

    def line_of(self, index: int) -> int:
        """Give the line, from 1, of the meaningful line `index`, from 0."""
        # The skipped line number s_i comes after s_i - 1 - i meaningful ones.
        before = bisect_right(range(len(self._skipped)), index, key=lambda i: self._skipped[i] - 1 - i)
        return self._before + index + 1 + before

    def next(self, what: str) -> str:
        """Give the next meaningful line, or complain that `what` is missing."""
        for line in self._stream:
            self.used += 1
            return line
        raise InvalidInput(f"{self.name}: ends where {what} should follow; is the file truncated?")

    def put_back(self, line: str) -> None:
        """Undo one `next`."""
        self.used -= 1
        self._stream = chain((line,), self._stream)

    def take(self, count: int | None, what: str) -> list[str]:
        """Give the next `count` meaningful lines, or all that are left.

        Raises
        ------
        InvalidInput
            Fewer are left.
        """
        first = self.used
        found = list(islice(self._stream, None if count is None else min(count, 1 << 62)))
        self.used += len(found)
        if count is not None and len(found) < count:
            self._fail_short(first, len(found), count, what)
        return found

    def table(
        self,
        count: int | None,
        columns: int | None,
        what: str,
        delimiter: str | None = None,
        decimal_comma: bool = False,
    ) -> NDArray[np.float64]:
        """Parse the next `count` meaningful lines, or all that are left, as a table of numbers.

        Parameters
        ----------
        count : int or None
        columns : int or None
            None: as many as the first line has.
        what : str
            What messages call a row, in the plural.
        delimiter : str, optional
            White space by default.
        decimal_comma : bool
            Whether ``1,5`` is one and a half.

        Returns
        -------
        (count, columns) ndarray of float64

        Raises
        ------
        InvalidInput
            Too few lines, a line with another number of columns, a word that is no number.
        """
        first = self.used
        blocks: list[NDArray[np.float64]] = []
        stream = self._stream if count is None else islice(self._stream, min(count, 1 << 62))
        while block := list(islice(stream, _BLOCK)):
            if delimiter and any(line.endswith(delimiter) for line in block[:1]):
                block = [line.rstrip(delimiter + " \t") for line in block]
            if decimal_comma:
                block = [line.replace(",", ".") for line in block]
            blocks.append(self.parse(block, self.used, columns, delimiter))
            columns = blocks[-1].shape[1]
            self.used += len(block)
        if count is not None and self.used - first < count:
            self._fail_short(first, self.used - first, count, what)
        return np.concatenate(blocks) if blocks else np.zeros((0, columns or 0))

    def parse(
        self, lines: list[str], first: int, columns: int | None = None, delimiter: str | None = None
    ) -> NDArray[np.float64]:
        """Parse lines, `first` being the index of the first of them, as a table of numbers."""
        if not lines:
            return np.zeros((0, columns or 0))
        try:
            table = np.loadtxt(lines, delimiter=delimiter, comments=None, ndmin=2)
        except ValueError as error:
            self._fail_parse(lines, first, columns, delimiter)
            raise InvalidInput(f"{self.name}: from line {self.line_of(first)} on: {error}") from error
        if columns is not None and table.shape[1] != columns:
            self._fail_parse(lines, first, columns, delimiter)
        return table

    def scattered(self, rows: list[str], places: list[int], columns: int | None = None) -> NDArray[np.float64]:
        """Parse rows, each with the index of its meaningful line, as a table of numbers."""
        if not rows:
            return np.zeros((0, columns or 0))
        if "" not in rows:
            try:
                table = np.loadtxt(rows, comments=None, ndmin=2)
            except ValueError:
                table = np.zeros((0, 0))
            if len(table) == len(rows) and columns in (None, table.shape[1]):
                return table
        width = columns or len(rows[0].split())
        for row, place in zip(rows, places):
            self._fail_parse([row], place, width, None)
        raise InvalidInput(f"{self.name}: line {self.line_of(places[0])}: expected numbers")

    def ragged(self, lines: list[str], first: int) -> list[tuple[NDArray[np.int64], NDArray[np.float64]]]:
        """Parse lines of unequal length, grouped by length: (place among `lines`, table) of each group."""
        groups: dict[int, list[int]] = {}
        for place, line in enumerate(lines):
            groups.setdefault(len(line.split()), []).append(place)
        parsed = []
        for width, places in sorted(groups.items()):
            rows = [lines[place] for place in places]
            try:
                table = np.loadtxt(rows, comments=None, ndmin=2)
            except ValueError as error:
                for place in places:
                    self._fail_parse([lines[place]], first + place, width, None)
                raise InvalidInput(f"{self.name}: from line {self.line_of(first)} on: {error}") from error
            parsed.append((np.asarray(places, np.int64), table))
        return parsed

    def error(self, index: int, message: str) -> InvalidInput:
        """Make the error for the meaningful line `index`."""
        return InvalidInput(f"{self.name}: line {self.line_of(index)}: {message}")

    def _fail_short(self, first: int, found: int, count: int, what: str) -> None:
        raise InvalidInput(
            f"{self.name}: promises {count} {what} from line {self.line_of(first)} on but has {found}; "
            "is the file truncated, or the count wrong?"
        )

    def _fail_parse(self, lines: list[str], first: int, columns: int | None, delimiter: str | None) -> None:
        """Name the first line that is not `columns` numbers."""
        for place, line in enumerate(lines):
            words = line.split(delimiter)
            if columns is None:
                columns = len(words)
            if len(words) != columns:
                raise self.error(first + place, f"{count_of(len(words), 'column')}, expected {columns}: {shown(line)}")
            for column, word in enumerate(words, 1):
                if not is_number(word):
                    said = f"{shown(word)} is not a number" if word.strip() else "an empty field"
                    raise self.error(first + place, f"column {column}: {said}")


def is_number(word: str) -> bool:
    """Tell whether a word is a decimal number (NaN and infinity count, digits joined by ``_`` do not)."""
    try:
        float(word)
    except ValueError:
        return False
    return "_" not in word and word.isascii()


def shown(text: str, limit: int = 40) -> str:
    """Give text in quotes for a message: one line, printable, cut to `limit` characters."""
    return ascii(text if len(text) <= limit else text[:limit] + "...")


def one_line(error: BaseException) -> str:
    """Give what another library's error says, on one short line."""
    text = " ".join(str(error).split())
    return text[:100] or type(error).__name__


def count_of(n: int, noun: str) -> str:
    """Give ``1 column`` or ``2 columns``."""
    return f"{n:,} {noun}" if n == 1 else f"{n:,} {noun}s"
