#!/usr/bin/env bash
# Set up from scratch and run the main job on a cloud it makes itself: a knotted tube, 20,000 points, no normals.
set -euo pipefail
cd "$(dirname "$0")/.."
venv=${VENV:-.venv}
if [ ! -x "$venv/bin/recon" ]; then
    "${PYTHON:-python3}" -m venv "$venv"
    "$venv/bin/python" -m pip install --quiet .
fi
"$venv/bin/recon" sample trefoil cloud.ply -n 20000 --seed 0
"$venv/bin/recon" reconstruct cloud.ply mesh.ply
"$venv/bin/recon" measure mesh.ply trefoil
