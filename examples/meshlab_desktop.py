"""For MeshLab's desktop program, which cannot load filters written in Python: make the mesh here, then open it there.

Usage: python meshlab_desktop.py CLOUD [MESH] [options of "recon reconstruct"]. Opens CLOUD and MESH as two layers where a program
"meshlab" is on the path. Filters > Show current filter script > Open script then takes clean_up.mlx, whose place is printed.
"""

import shutil
import subprocess
import sys

from recon.stages.mlx import CLEAN_UP

if len(sys.argv) < 2:
    sys.exit(__doc__)
cloud, rest = sys.argv[1], sys.argv[2:]
mesh = rest.pop(0) if rest and not rest[0].startswith("-") else "mesh.ply"
run = subprocess.run([sys.executable, "-m", "recon", "reconstruct", cloud, mesh, *rest])
if run.returncode:
    sys.exit(run.returncode)
print(f"{mesh} is ready; the clean-up script is {CLEAN_UP}")
program = shutil.which("meshlab")
if program is not None:
    subprocess.Popen([program, cloud, mesh])
