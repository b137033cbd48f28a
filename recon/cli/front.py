"""What all commands share: exit codes, one-line errors, options, where text goes."""

from __future__ import annotations

import errno
import glob
import os
import sys
import threading
from collections.abc import Callable, Sequence
from typing import Any, TypeVar

import click
from click.shell_completion import CompletionItem

Result = TypeVar("Result")

_UNWRITABLE = (errno.ENOSPC, getattr(errno, "EDQUOT", errno.ENOSPC), errno.EIO, errno.EFBIG)  # while text is printed
PATH = click.Path(allow_dash=True)  # so that shells complete file names; whether there is such a file is read's to say
OK, BUG, INPUT, DEGENERATE, MISSING, GUARANTEE, PIPE = 0, 1, 2, 3, 4, 5, 141


class Alpha(click.ParamType):
    """A number that can stand for a squared length: finite, and added to weights within their range."""

    name = "float"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """Read it."""
        number = click.FLOAT.convert(value, param, ctx)
        if not abs(number) < 1e200:
            self.fail(f"{value} is no squared length, which is a finite number below 1e200.", param, ctx)
        return number


class Front(click.Group):
    """A command group that turns every error into one line on stderr and an exit code."""

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command that was asked for and map its errors to exit codes."""
        try:
            return _aside(lambda: super(Front, self).invoke(ctx))
        except (click.ClickException, click.exceptions.Exit, click.Abort):
            raise
        except BrokenPipeError:
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # or Python complains at exit
            ctx.exit(PIPE)
        except OSError as error:
            if error.errno not in _UNWRITABLE:
                _report_bug(error)
                ctx.exit(BUG)
            complain(f"the output cannot be written: {error.strerror}")
            ctx.exit(INPUT)
        except MemoryError:
            complain("not enough memory for this input; use fewer points, or a machine with more")
            ctx.exit(BUG)
        except Exception as error:  # the outermost frame: a bug must not look like bad input
            code = exit_code(error)
            if code is None:
                _report_bug(error)
            else:
                complain(" ".join(str(error).split()))
            ctx.exit(BUG if code is None else code)


def exit_code(error: BaseException) -> int | None:
    """Give the exit code of an error; None for a bug."""
    from ..contracts import CertificateError, DegenerateInput, InvalidInput, MissingDependency, StageError

    codes: tuple[tuple[type[BaseException], int], ...] = (
        (InvalidInput, INPUT),
        (DegenerateInput, DEGENERATE),
        (MissingDependency, MISSING),
        (CertificateError, GUARANTEE),
        (StageError, BUG),
    )
    return next((code for kind, code in codes if isinstance(error, kind)), None)


def expanded(paths: Sequence[str]) -> list[str]:
    """Replace patterns that the shell has left, such as quoted ones, by the files that they match."""
    found: list[str] = []
    for path in paths:
        matches = sorted(glob.glob(path, recursive=True)) if glob.has_magic(path) and not os.path.exists(path) else []
        found += matches or [path]
    return found


def complain(message: str) -> None:
    """Print a line on stderr."""
    click.echo(f"recon: {message}", err=True)


def shared(*names: str) -> Callable[[Callable], Callable]:
    """Add options that several commands have."""
    options = {
        "json": click.option("--json", "as_json", is_flag=True, help="Print JSON instead of text."),
        "quiet": click.option("-q", "--quiet", is_flag=True, help="No progress and no remarks, only errors and what was asked for."),
        "threads": click.option(
            "--threads", type=click.IntRange(1, 1024), metavar="N", help="Threads to use; the result does not depend on it."
        ),
        "from": click.option(
            "--from", "source_format", metavar="FORMAT", shell_complete=_formats,
            help="Format of the input, such as xyz; by default it is recognised.",
        ),
        "to": click.option(
            "--to", "target_format", metavar="FORMAT", shell_complete=_formats,
            help="Format of the output; by default its extension, ply for -.",
        ),
        "drop": click.option(
            "--drop-invalid", is_flag=True, help="Leave out rows with NaN or infinite coordinates, and count them."
        ),
        "weights": click.option(
            "--weights", default="adaptive", metavar="adaptive|uniform|radius|FILE", show_default=True, type=PATH,
            help="Squared radius of the ball around each point: from local density, the same for all, from the radii in "
            "the input, or one number a line in a file.",
        ),
        "against": click.option(
            "--against", metavar="FILE|SURFACE", shell_complete=surface_names,
            help="Compare with this: a mesh, points, or a surface of `recon sample --list`.",
        ),
    }  # fmt: skip

    def decorate(command: Callable) -> Callable:
        for name in reversed(names):
            command = options[name](command)
        return command

    return decorate


def print_table(rows: Sequence[tuple[str, ...]], err: bool = False) -> None:
    """Print rows as columns: the last one is not padded."""
    if not rows:
        return
    widths = [max(len(row[i]) for row in rows if i < len(row)) for i in range(max(map(len, rows)))]
    for row in rows:
        cells = [cell.ljust(width) for cell, width in zip(row[:-1], widths)]
        click.echo("  ".join([*cells, row[-1]]).rstrip(), err=err)


def surface_names(ctx: click.Context, parameter: click.Parameter, begun: str) -> list[CompletionItem]:
    """Complete the name of an analytic surface, and where there is none a file."""
    import datasets_synthetic

    names = [CompletionItem(name) for name in datasets_synthetic.surfaces() if name.startswith(begun)]
    return names or [CompletionItem(begun, type="file")]


def _formats(ctx: click.Context, parameter: click.Parameter, begun: str) -> list[str]:
    from ..io import formats

    known = formats.READERS if parameter.name == "source_format" else {**formats.MESH_WRITERS, **formats.POINT_WRITERS}
    return sorted(name for name in known if name.startswith(begun))


def _aside(work: Callable[[], Result]) -> Result:
    """Run `work` in a thread of its own and give its result or raise its error.

    Compiled code does not look for signals, but it runs without the interpreter lock: the main thread stays free to
    answer them.
    """
    results: list[Result] = []
    errors: list[BaseException] = []

    def run() -> None:
        try:
            results.append(work())
        except BaseException as error:  # handed to the main thread, nothing is swallowed
            errors.append(error)

    thread = threading.Thread(target=run, name="recon-work", daemon=True)
    thread.start()
    while thread.is_alive():
        thread.join(0.1)  # not for ever: Windows would not wake it
    if errors:
        raise errors[0]
    return results[0]


def _report_bug(error: BaseException) -> None:
    if os.environ.get("RECON_DEBUG"):
        import traceback

        traceback.print_exc()
    complain(f"internal error: {' '.join(f'{type(error).__name__}: {error}'.split())}")
    complain("this is a bug: please report it with the command; RECON_DEBUG=1 shows where it happened")
