"""Generate bad inputs for every command from valid inputs and a seed."""

import math
import re
import tomllib
from dataclasses import dataclass, field
from itertools import pairwise
from random import Random
from typing import Any

from chaincor.lammps_inputs.scene import Scene
from tests.extremes.materials import SCENES, SWEEPS, materials

NASTY_TEXTS = (
    "",
    " ",
    "nan",
    "lj\n",
    "../../etc/passwd",
    "a" * 5000,
    "$(shell)",
    '"; shell touch pwned; "',
    "\u2028shell touch pwned",
    "\x00",
    "résumé \U0001f40d",
    "-1",
    "'",
)
NASTY_NUMBERS = (
    "0",
    "-0.0",
    "-1",
    "1",
    "2",
    "3.7",
    "6",
    "40",
    "nan",
    "inf",
    "-inf",
    "1e400",
    "1e-400",
    "1e308",
    "5e-324",
    "1e-300",
    "1e-12",
    "1e-5",
    "0.3",
    "1e3",
    "1e20",
    "99999999999999999999",
    "1" + "0" * 400,
    "0x10",
    "1_0",
    "true",
    "[]",
    "{}",
    "1979-05-27",
    '"1"',
    "''",
)
_POTENTIALS = (
    *("harmonic", "lj", "toda", "morse", "log", "power", "table", "formula", "LJ", "nope"),
)
# Sizes stay below these limits, because a valid input that takes long is no bad input.
_MOST_PARTICLES = 12
_MOST_ROWS = 5000
_SHORTEST_STEP = 2e-3
_NO_STEP_AT_ALL = 1e-9
_MOST_FRAMES = 1e3
_MOST_POINTS = 500


@dataclass(frozen=True)
class Case:
    """One call of the command line."""

    arguments: tuple[str, ...]  #: Command and options.
    #: Files in the folder where the command runs.
    files: dict[str, bytes] = field(default_factory=dict)
    outputs: tuple[str, ...] = ()  #: Files and folders that the command may make there.


def case(number: int) -> Case:
    """Return the case with this number, which is always the same."""
    random = Random(number)
    while True:
        made = random.choices(
            (_run_options, _run_file, _table, _inputs, _validate, _sweep, _analyze, _store, _words),
            weights=(24, 20, 6, 8, 6, 12, 14, 8, 2),
        )[0](random)
        if _affordable(made):
            return made


def mutate(random: Random, data: bytes) -> bytes:
    """Return the data, damaged at one to three places."""
    for _ in range(random.randint(1, 3)):
        damage = random.randrange(9)
        at = random.randrange(len(data) + 1)
        if damage == 0:
            data = data[:at]
        elif damage == 1:
            data = data[:at] + bytes([random.randrange(256)]) + data[at:]
        elif damage == 2:
            data = data[:at] + data[at + random.randint(1, 20) :]
        elif damage == 3:
            data = data[:at] + random.choice(NASTY_TEXTS).encode() + data[at:]
        elif damage == 4:
            lines = data.split(b"\n")
            random.shuffle(lines)
            data = b"\n".join(lines)
        elif damage == 5:
            data = data[:at] + data[max(0, at - 40) : at] + data[at:]
        elif damage == 6:
            data = bytes(random.randrange(256) for _ in range(random.randrange(200)))
        else:
            numbers = list(re.finditer(rb"(?<![\w.])-?\d[\d.e+-]*", data[:200_000]))
            if numbers:
                spot = random.choice(numbers)
                value = random.choice(NASTY_NUMBERS).encode()
                data = data[: spot.start()] + value + data[spot.end() :]
    return data


def _scene_text(random: Random) -> bytes:
    lines = random.choice(SCENES).strip().split("\n")
    for _ in range(random.randint(0, 3)):
        action = random.randrange(4)
        spot = random.randrange(len(lines))
        key = random.choice(list(Scene.model_fields))
        value = random.choice((*NASTY_NUMBERS, *(f'"{name}"' for name in _POTENTIALS)))
        if action == 0 and len(lines) > 1:
            del lines[spot]
        elif action == 1:
            lines.append(f"{key} = {value}")
        elif action == 2:
            lines[spot] = lines[spot].split("=")[0] + f"= {value}"
        else:
            lines.append(f"{key} = {toml_text(random.choice(NASTY_TEXTS))}")
    data = ("\n".join(lines) + "\n").encode()
    return mutate(random, data) if random.random() < 0.4 else data


def toml_text(text: str) -> str:
    """Return a TOML basic string that holds any text."""
    escaped = "".join(c if c not in '"\\' and c.isprintable() else f"\\U{ord(c):08x}" for c in text)
    return f'"{escaped}"'


def _options(random: Random, names: tuple[str, ...]) -> list[str]:
    words = []
    for name in random.sample(names, random.randint(1, 4)):
        value = random.choice(
            (*NASTY_NUMBERS, *_POTENTIALS, *NASTY_TEXTS, "event", "verlet", "order8", "spline")
        ).replace("\x00", "")
        words += [f"--{name}", value]
    return words


_SCENE_OPTIONS = (
    "potential",
    "toda-b",
    "power-order",
    "power-c",
    "particles",
    "speed",
    "velocity",
    "engine",
    "tolerance",
    "wall",
    "scheme",
    "timestep",
    "table",
    "table-points",
)
_QUICK = ("--particles", "3", "--tolerance", "1e-4")
_CONSISTENT = (
    ("--particles", "2", "--engine", "reference", "--tolerance"),
    ("--particles", "3", "--speed"),
    ("--particles", "4", "--engine", "reference", "--speed"),
    ("--potential", "harmonic", "--particles", "3", "--velocity"),
    ("--potential", "log", "--particles", "3", "--engine", "reference", "--velocity"),
    ("--potential", "toda", "--particles", "2", "--toda-b"),
    ("--potential", "power", "--power-order", "4", "--particles", "2", "--power-c"),
    ("--potential", "power", "--power-c", "-1", "--particles", "2", "--power-order"),
    ("--particles", "2", "--no-error", "--scheme", "order4", "--timestep"),
    ("--particles", "2", "--no-error", "--engine", "reference", "--timestep"),
    ("--particles", "3", "--no-error", "--scheme", "verlet", "--table-points"),
    ("--particles",),
)


def _run_options(random: Random) -> Case:
    if random.random() < 0.5:
        words = [*random.choice(_CONSISTENT), random.choice(NASTY_NUMBERS)]
        if words[-2] not in ("--tolerance", "--timestep", "--table-points"):
            words += ["--tolerance", "1e-4"]
    else:
        words = [*_QUICK, *_options(random, _SCENE_OPTIONS)]
    outputs: list[str] = []
    for option in ("arrays", "dump", "save"):
        if random.random() < 0.1:
            outputs.append(random.choice(("out", "deep/out", "out.npz", "taken")))
            words += [f"--{option}", outputs[-1]]
    if random.random() < 0.7:
        words.append("--json")
    return Case(("run", *words), {"taken": b"good"}, tuple(outputs))


def _run_file(random: Random) -> Case:
    files = {"scene.toml": _scene_text(random), "bond.table": materials().table}
    return Case(("run", "scene.toml", *random.choice(((), ("--json",)))), files, _named(files))


def _named(files: dict[str, bytes]) -> tuple[str, ...]:
    """Return the outputs that a scene file requests, in any folder."""
    fields = _fields(files.get("scene.toml", b""))
    return tuple(str(fields[key]) for key in ("arrays", "dump", "save") if key in fields)


def _table(random: Random) -> Case:
    files = {
        "scene.toml": SCENES[-1].encode(),
        "bond.table": mutate(random, materials().table),
    }
    engine = random.choice(("lammps", "reference"))
    return Case(("run", "scene.toml", "--engine", engine, "--json"), files)


def _inputs(random: Random) -> Case:
    files = {"scene.toml": _scene_text(random), "bond.table": materials().table}
    words = ["inputs", "scene.toml", "-o", random.choice(("job", "deep/job", "scene.toml"))]
    words += random.choice(([], ["--frames"], ["--explain"], ["--force"]))
    return Case(tuple(words), files, ("job", "deep"))


def _validate(random: Random) -> Case:
    known = materials()
    name, data = random.choice((("f.csv", known.final_csv), ("f.npz", known.final_npz)))
    files = {name: mutate(random, data)}
    words = ["validate", "--particles", "3", "--speed", "0.4", "--tolerance", "1e-4"]
    words += ["--against", random.choice((name, name, name, "missing.csv", "nothing", ":", "a:"))]
    if random.random() < 0.2:
        words += _options(random, _SCENE_OPTIONS)
    return Case((*words, "--json"), files)


def _sweep(random: Random) -> Case:
    text = random.choice(SWEEPS).encode()
    lines = text.split(b"\n")
    action = random.randrange(3)
    if action == 0:
        text = mutate(random, text)
    elif action == 1:
        key = random.choice((*Scene.model_fields, "store", "arrays", "zip", "spacing"))
        lines.insert(
            random.randrange(len(lines)), f"{key} = {random.choice(NASTY_NUMBERS)}".encode()
        )
        text = b"\n".join(lines)
    else:
        spots = list(re.finditer(rb'"\w+"|[\d.]+(?:e-?\d+)?', text))
        spot = random.choice(spots)
        text = text[: spot.start()] + random.choice(NASTY_NUMBERS).encode() + text[spot.end() :]
    words = ["sweep", "sweep.toml", "--dry-run"]
    words += random.choice(([], ["--json"], ["--shard", random.choice(("1/2", "0/1", "x", "3/2"))]))
    files = {"sweep.toml": text}
    if random.random() < 0.3:
        files["sweep.sqlite"] = mutate(random, materials().store)
    return Case(tuple(words), files)


def _analyze(random: Random) -> Case:
    files = {f"job/{name}": data for name, data in materials().job.items()}
    name = random.choice([*files, "job/dump.lammpstrj", "job/dump.lammpstrj"])
    if random.random() < 0.1:
        del files[name]
    else:
        files[name] = mutate(random, files[name])
    words = ["analyze", "job", "--json"]
    if random.random() < 0.3:
        words += _options(random, ("potential", "timestep", "velocity", "toda-b", "data", "dump"))
    return Case(tuple(words), files)


def _store(random: Random) -> Case:
    data = materials().store
    if random.random() < 0.6:
        data = mutate(random, data)
    files = {"s.sqlite": data}
    kind = random.randrange(4)
    if kind == 0:
        option = random.choice(("--where", "--sort", "--columns", "--limit"))
        column = random.choice(("speed", "restitution", "nope", "scene_json", "failure"))
        value = column + random.choice(("", "<1", "=", "!=", "<", ">=nan", " or 1=1", '";--'))
        return Case(("show", "s.sqlite", option, value, *random.choice(((), ("--json",)))), files)
    if kind == 1:
        return Case(("store", "export", "s.sqlite", "o.csv"), files, ("o.csv",))
    if kind == 2:
        files["t.sqlite"] = random.choice((materials().store, b"", mutate(random, data)))
        return Case(("store", "merge", "t.sqlite", "s.sqlite"), files, ("t.sqlite",))
    return Case(("show", "s.sqlite", "--json"), files)


def _words(random: Random) -> Case:
    words = ("run", "sweep", "show", "store", "merge", "-o", "--json", "--", "-", *NASTY_TEXTS)
    chosen = [w.replace("\x00", "") for w in random.sample(words, random.randint(0, 4))]
    quick = ("run", *_QUICK)
    return Case(quick if chosen[:1] == ["run"] else tuple(chosen))


def _fields(data: bytes) -> dict[str, Any]:
    try:
        return tomllib.loads(data.decode())
    except (ValueError, RecursionError):
        return {}


def _affordable(made: Case) -> bool:
    """Return whether the case, if it is valid, is quick."""
    fields: list[tuple[str, Any]] = []
    for name, data in made.files.items():
        if name.endswith(".toml"):
            fields += _flat(_fields(data))
    words = made.arguments
    for option, value in pairwise(words):
        if option.startswith("--"):
            fields.append((option[2:].replace("-", "_"), value))
    if words[:1] == ("run",) and not any(key == "particles" for key, _ in fields):
        return False
    points = 1
    for key, value in fields:
        try:
            number = float(value)
        except (TypeError, ValueError, OverflowError):
            continue
        if key == "particles" and _MOST_PARTICLES < number <= 1e7:
            return False
        if key == "table_points" and _MOST_ROWS < number <= 1e7:
            return False
        if key == "timestep" and _NO_STEP_AT_ALL <= number < _SHORTEST_STEP:
            return False
        if key == "dump_frames" and _MOST_FRAMES < number < math.inf:
            return False
        if key == "points":
            points *= max(1, int(min(number, 1e9))) if math.isfinite(number) else 1
        if key == "step" and 0 < number < 1e-2:
            return False
    return points <= _MOST_POINTS


def _flat(fields: Any, key: str = "") -> list[tuple[str, Any]]:
    if isinstance(fields, dict):
        return [pair for name, value in fields.items() for pair in _flat(value, name)]
    if isinstance(fields, list):
        return [pair for value in fields for pair in _flat(value, key)]
    return [(key, fields)]
