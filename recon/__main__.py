"""``python -m recon``: the command line."""

from .cli import main

main(prog_name="recon")
