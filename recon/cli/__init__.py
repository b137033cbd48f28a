"""The command line. Commands import what they need when they run, so that ``recon --help`` is quick."""

from __future__ import annotations

import click

from .. import __version__
from .alphas import alphas
from .check import check
from .front import Front
from .info import info
from .measure import measure
from .reconstruct import reconstruct
from .sample import sample
from .view import view

_EPILOG = """
\b
Examples:
  recon reconstruct scan.ply mesh.ply
  recon info scan.xyz
  recon sample torus torus.xyz -n 10000 --noise 0.002
  recon measure mesh.ply torus
  recon view scan.ply -o view.html
  recon reconstruct scans/*.las meshes/

"-" is standard input or output. Exit codes: 0 done, 2 bad input or usage, 3 input without an answer, 4 an optional
package is missing, 5 an asked-for guarantee does not hold, 1 a bug, 130 interrupted.

\b
Completion of commands, options and names, for bash (zsh_source and fish_source likewise):
  eval "$(_RECON_COMPLETE=bash_source recon)"
"""


@click.group(
    cls=Front, epilog=_EPILOG, context_settings={"help_option_names": ["--help", "-h"], "max_content_width": 110}
)
@click.version_option(__version__, prog_name="recon")
def main() -> None:
    """Turn point clouds into trustworthy triangle meshes.

    No normals are needed and no parameter has to be tuned.
    """


for _command in (reconstruct, info, alphas, measure, sample, view, check):
    main.add_command(_command)
