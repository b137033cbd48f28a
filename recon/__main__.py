"""The program ``recon``, ``python -m recon`` as well: signals are taken care of before anything else is imported."""

import os
import sys

try:
    import signal  # takes longer than all that stands before
except KeyboardInterrupt:
    sys.exit(130)


def run() -> None:
    """Run the command line. Ctrl-C and SIGTERM end the process at once, whatever its threads are busy with."""
    for number in (signal.SIGINT, signal.SIGTERM):
        if signal.getsignal(number) is not signal.SIG_IGN:  # as of a job in the background
            signal.signal(number, _leave)
    from .cli import main

    main(prog_name="recon")


def _leave(number: int, frame: object) -> None:
    """Remove what is half-written, say so, and exit: 130 for Ctrl-C, 143 for SIGTERM."""
    signal.signal(number, signal.SIG_IGN)
    discard = getattr(sys.modules.get("recon.io.files"), "discard_unfinished", None)
    if discard is not None:  # where it is still being imported, nothing is written yet
        discard()
    line = "\r\x1b[K" if os.isatty(2) else ""  # over the line of progress
    os.write(2, f"{line}recon: interrupted; nothing half-written was left\n".encode())
    os._exit(128 + number)


if __name__ == "__main__":
    run()
