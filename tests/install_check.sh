#!/usr/bin/env bash
# Check a plain `pip install .` in a new environment: the program runs, the packages installed are
# small enough, and the analysis works without LAMMPS. Then check the installation from a source
# distribution and the editable installation.
set -euo pipefail
cd "$(dirname "$0")/.."
project=$PWD
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

fail() {
  echo "$1" >&2
  exit 1
}

# Print the top-level entries of the installation in site-packages.
top_level() {
  "$folder/venv/bin/python" -c '
from importlib import metadata
print(*sorted({f.parts[0] for f in metadata.files("chaincor") if f.parts[0] != ".."}))'
}

installed_files() {
  (cd "$folder"/venv/lib/python3*/site-packages/chaincor && find . -type f -not -path '*__pycache__*' | sort)
}

started=$SECONDS
"${PYTHON:-python3}" -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip install --quiet --upgrade pip
"$folder/venv/bin/python" -m pip install --quiet .
echo "installed in $((SECONDS - started)) s"
du -sm "$folder/venv" | awk '{ print "environment: " $1 " MiB"; if ($1 > 1331) exit 1 }'
du -sm "$folder"/venv/lib/python3*/site-packages/* | sort -rn | awk 'NR <= 12'  # head could stop sort by a signal
cd "$folder"
[[ $(top_level) =~ ^chaincor\ chaincor-[0-9.]+\.dist-info$ ]] || fail "at top level: $(top_level)"
installed_files > plain
venv/bin/chaincor doctor
venv/bin/chaincor explain SceneError > /dev/null
venv/bin/chaincor run --particles 10 --json > /dev/null
venv/bin/python -m chaincor --help > /dev/null
venv/bin/python -c "from chaincor.workflows.lessons import check, prepared; assert check('1.1', [1, 1]) and prepared('lengths.csv').exists()"
{ venv/bin/chaincor lessons 2>&1 || true; } | tr '\n' ' ' | grep -q 'pip install chaincor\[notebook\]' || fail "lessons do not say what they need"

# Run a user's script, and check it by mypy, beside files with the names of our folders.
mkdir script
for name in analysis lammps_inputs workflows; do echo "MINE = 'mine'" > "script/$name.py"; done
cat > script/script.py << 'END'
import analysis
import lammps_inputs
import workflows
from chaincor import Scene, collide

result = collide(Scene(potential="lj", particles=10, speed=0.4))
assert {analysis.MINE, lammps_inputs.MINE, workflows.MINE} == {"mine"}
print(result.restitution)
reveal_type(result.restitution)
END
sed '/^reveal_type/d' script/script.py > script/plain.py
(cd script && ../venv/bin/python plain.py)
venv/bin/python -m pip install --quiet mypy
(cd script && ../venv/bin/python -m mypy script.py | grep 'Revealed type is "\(builtins\.\)\?float"') || fail "mypy does not see our types"

# A source distribution must install the same files. From here on, all installations share compiled loops.
export NUMBA_CACHE_DIR="$folder/loops"
venv/bin/python -m pip install --quiet hatchling
(cd "$project" && "$folder/venv/bin/hatchling" build --target sdist --directory "$folder/dist" > /dev/null)
venv/bin/python -m pip install --quiet --no-deps --force-reinstall dist/chaincor-*.tar.gz
installed_files | diff plain - || fail "a source distribution installs something else"
venv/bin/chaincor run --particles 10 --json > /dev/null

# An editable installation must use this checkout, although earlier compiled code remains that pip does not know.
venv/bin/python -m pip install --quiet --editable "$project"
venv/bin/chaincor run --particles 10 --json > /dev/null
(cd script && ../venv/bin/python plain.py)
venv/bin/python -c "import chaincor.workflows as w; assert w.__file__.startswith('$project'), w.__file__"

venv/bin/python -m pip uninstall --quiet --yes lammps mpich
venv/bin/python -c "import chaincor.analysis.modes, chaincor.analysis.restitution"
venv/bin/chaincor run --engine reference --particles 10 > /dev/null
if venv/bin/chaincor doctor > /dev/null; then fail "doctor says yes without LAMMPS"; fi
echo "installation is good"
