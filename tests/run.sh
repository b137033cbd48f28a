#!/usr/bin/env bash
# Set up from scratch and run every check: lint, format, types, tests, documentation. Usage: bash tests/run.sh [pytest arguments]
#   PYTHON   the interpreter to use (default python3)
#   VENV     where the virtual environment goes (default .venv-test; made anew)
set -euo pipefail
cd "$(dirname "$0")/.."
venv=${VENV:-.venv-test}
libraries="libgl1 libegl1 libx11-6 libusb-1.0-0 libudev1 libidn2-0 libgomp1 libopengl0 libfontconfig1 libfreetype6 libgmp10 libp11-kit0 chromium chromium-driver"

# open3d and pymeshlab, which some tests compare with, need these libraries; the pages are tried in Chromium.
if command -v apt-get >/dev/null && [ "$(id -u)" = 0 ]; then
    (apt-get update -qq && DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends $libraries) >/dev/null
elif ! ldconfig -p | grep -q 'libEGL.so.1' || ! command -v chromedriver >/dev/null; then
    echo "tests/run.sh: open3d and pymeshlab need system libraries, the pages Chromium; on Debian or Ubuntu: sudo apt-get install $libraries" >&2
    exit 1
fi

rm -rf "$venv"
"${PYTHON:-python3}" -m venv "$venv"
"$venv/bin/python" -m pip install --quiet --upgrade pip
"$venv/bin/python" -m pip install --quiet ".[test]"
"$venv/bin/ruff" check .
"$venv/bin/ruff" format --check .
"$venv/bin/mypy"
"$venv/bin/mkdocs" build --quiet --strict --site-dir "$venv/site"
"$venv/bin/python" -m pytest -n 2 "$@"
