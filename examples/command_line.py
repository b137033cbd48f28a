"""The command line from a script: points in, mesh out, figures as JSON. Usage: python command_line.py [CLOUD [MESH]]"""

import json
import subprocess
import sys

cloud = sys.argv[1] if len(sys.argv) > 1 else "cloud.ply"
mesh = sys.argv[2] if len(sys.argv) > 2 else "mesh.ply"
recon = [sys.executable, "-m", "recon"]
if len(sys.argv) == 1:  # nothing given: a knotted tube, 8,000 points, no normals
    subprocess.run([*recon, "sample", "trefoil", cloud, "-n", "8000", "--seed", "0"], check=True)

run = subprocess.run([*recon, "reconstruct", cloud, mesh, "--json"], check=True, stdout=subprocess.PIPE, text=True)
report = json.loads(run.stdout)
print(f"{mesh}: a {report['surface']['kind']} surface of {report['mesh']['faces']:,} triangles,", end=" ")
print(f"chi {report['mesh']['chi']}, {report['mesh']['open_edges']} open edges")
