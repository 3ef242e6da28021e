"""
A user's script made obey: other steps for the same time, samples of numbers, no dumps.

Nothing of the script is edited but commands that run, write frames, or set what is varied. Between
runs the script sees its own step, so that what it computes from ``dt`` stays as it was; around each
``run`` the step is changed for that run alone, to one that divides the run's time exactly.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from chaincor.workflows.scripts.script_text import join_lines
from chaincor.workflows.scripts.step_counts import count_positions

# So many samples of a run are wanted.
SAMPLES = 200
SAMPLE_FILE, FRAME_FILE = "chaincor_samples.txt", "chaincor_frames.txt"
STEP_FILE = "chaincor_step.txt"
_BEFORE, _AFTER, _SAMPLE = "chaincor_before.in", "chaincor_after.in", "chaincor_sample.in"
_LEFT_OUT = ("dump", "undump", "dump_modify", "restart")
# What may stand in a command's place where nothing shall.
_NOTHING = "variable chaincor_none string 0"
_NO_VALUES = ("loop", "delete", "world", "universe", "uloop")
_TABLES = ("pair_style", "bond_style", "angle_style")
_RESETS = ("reset_timestep", "read_restart")
_LARGEST = 10_000_000
_QUOTED = re.compile(r"\"([^\"]*)\"|'([^']*)'")
# Words that are seeds, counted from the end of what stands before them.
_SEEDED_FIXES = {
    "langevin": 7, "temp/csvr": 7, "temp/csld": 7, "brownian": 5, "deposit": 7, "pour": 6,
    "gcmc": 7, "atom/swap": 6, "widom": 7, "bond/swap": 7, "ttm": 4, "tfmc": 6,
}  # fmt: skip
_SEEDED = {
    ("velocity", 2, "create"): 4, ("pair_style", 1, "dpd"): 4, ("create_atoms", 2, "random"): 4,
    ("displace_atoms", 2, "random"): 6, ("set", 3, "type/fraction"): 6, ("set", 3, "type/ratio"): 6,
}  # fmt: skip


@dataclass(frozen=True)
class Change:
    """
    What one run does otherwise than the script says.

    Attributes
    ----------
    finer : float
        Steps for each step of the script: 2 halves the step. 1 leaves it.
    quantities : tuple of str
        What is sampled, as in formulas of LAMMPS: ``etotal``, ``c_1``, ``v_x``.
    variables : dict
        Values of the script's own variables, as text.
    settings : dict
        Of ``cutoff``, ``skin`` and ``rows``: what they shall be, as text.
    seed : int or None
        Added to every seed.
    scale_periods : bool
        Whether numbers of steps are held in time.
    shaken : float
        Share of the box by which all particles are displaced before the first run.
    frames : bool
        Whether positions are written with the samples.
    printed : bool
        Whether a number is read from what the script prints, and all thermo output stays.
    """

    finer: float = 1.0
    quantities: tuple[str, ...] = ()
    variables: Mapping[str, str] = field(default_factory=dict)
    settings: Mapping[str, str] = field(default_factory=dict)
    seed: int | None = None
    scale_periods: bool = False
    shaken: float = 0.0
    frames: bool = False
    printed: bool = False


def rewrite_folder(folder: Path, script: Path, change: Change) -> None:
    """Rewrite a copy of the script, and of what it may include, and write what these include."""
    for path in folder.rglob("*"):
        if path == script or _may_be_included(path):
            path.write_text(rewrite(path.read_text("utf-8", "replace"), folder, change), "utf-8")
    head = "variable chaincor_shift string 0\nvariable chaincor_first string 1\n"
    script.write_text(head + script.read_text("utf-8"), "utf-8")
    for name, text in _included(folder, change).items():
        (folder / name).write_text(text, "utf-8")


def _may_be_included(path: Path) -> bool:
    if not path.is_file() or path.stat().st_size > _LARGEST or path.suffix in (".py", ".md"):
        return False
    data = path.read_bytes()
    return b"\0" not in data[:4096] and bool(re.search(rb"(?m)^\s*(run|variable|fix|dump)\s", data))


def rewrite(text: str, folder: Path, change: Change) -> str:
    """Return the text of a script with its commands changed."""
    lines: list[str] = []
    for raw, command in join_lines(text):
        words = command.split()
        if words and words[0] == "if":
            lines.append(_QUOTED.sub(lambda found: _quoted(found, folder, change), command))
            continue
        changed = _command(command, folder, change)
        lines += [raw] if changed == [command] else (changed or [_NOTHING])
    return "\n".join([*lines, ""])


def _quoted(found: re.Match[str], folder: Path, change: Change) -> str:
    """Rewrite a command in quotes, as it stands behind ``then``."""
    quote, text = found[0][0], found[1] if found[1] is not None else found[2]
    if not text.split():
        return found[0]
    commands = _command(text, folder, change)
    return " ".join(f"{quote}{each}{quote}" for each in commands or [_NOTHING])


def _command(command: str, folder: Path, change: Change) -> list[str]:
    """Return what stands in a command's place."""
    words = command.split()
    if not words:
        return [command]
    name = words[0]
    if name == "run" and len(words) > 1:
        return _run(words, folder)
    if name in _LEFT_OUT:
        return []
    if name in _RESETS:
        return [command, "variable chaincor_shift string 0"]
    is_value = name == "variable" and len(words) > 2 and words[2] not in _NO_VALUES
    if is_value and words[1] in change.variables:
        return [f"variable {words[1]} index {change.variables[words[1]]}"]
    words = _set(list(words), change)
    if words[:2] == ["thermo_style", "custom"]:
        if not change.printed:
            # LAMMPS prints many fixes at multiples of their period alone, and a run at another step
            # seldom ends at one; the columns stay as many.
            words = ["time" if re.match(r"[fv]_", word) else word for word in words]
        # LAMMPS knows no keyword that its thermo output does not have.
        keywords = [each for each in change.quantities if not re.match(r"[cfv]_", each)]
        words += [each for each in keywords if each not in words]
    before: list[str] = []
    if change.scale_periods and change.finer != 1.0:
        before = _scale(words, change.finer)
    return [*before, " ".join(words)] if before or words != command.split() else [command]


def _run(words: list[str], folder: Path) -> list[str]:
    """Surround a run; what it counts in steps is counted in steps of the run that is made."""
    options, k = ["run", "${chaincor_m}"], 2
    upto, block, pre = "", "${chaincor_n}", True
    while k < len(words):
        word = words[k]
        value = words[k + 1] if k + 1 < len(words) else ""
        if word == "upto":
            upto = "upto"
            k += 1
        elif word in ("start", "stop"):
            options += [word, f"${{chaincor_{word}}}"]
            upto += f" {word} {value}"
            k += 2
        elif word == "every":
            block = value
            options += ["every", "${chaincor_p}", *words[k + 2 :]]
            break
        else:
            pre = pre and not (word == "pre" and value == "no")
            options += words[k : k + 2]
            k += 2
    lines = [f"variable chaincor_n string {words[1]}"]
    if upto.startswith("upto"):
        lines.append("variable chaincor_n string $(v_chaincor_n-step+v_chaincor_shift:%.15g)")
    lines += [
        f"variable chaincor_u string {block}",
        f"variable chaincor_pre string {int(pre)}",
        f"include {folder / _BEFORE}",
    ]
    for word, value in re.findall(r"(start|stop) (\S+)", upto):
        name = f"chaincor_{word}"
        # Rounded, they may not cut the run itself.
        least = "0" if word == "start" else "step+v_chaincor_m"
        lines += [
            f"variable {name} string {value}",
            f"variable {name} string $(round(step+(v_{name}-step+v_chaincor_shift)*v_chaincor_p/"
            "v_chaincor_u):%.15g)",
            f"variable {name} string $(ternary(v_{name}<{least},{least},v_{name}):%.15g)",
        ]
    return [*lines, " ".join(options), f"include {folder / _AFTER}"]


def _included(folder: Path, change: Change) -> dict[str, str]:
    """Return what runs include before and behind them."""
    finer = f"{change.finer:.17g}"

    def string(name: str, formula: str, form: str = ":%.15g") -> str:
        return f"variable chaincor_{name} string $({formula}{form})"

    before = [
        string("dt", "dt", ":%.17g"),
        string("u", "ternary(v_chaincor_u<1,1,v_chaincor_u)"),
        string("b", "ternary(v_chaincor_n<v_chaincor_u,1,v_chaincor_n/v_chaincor_u)"),
        string("e", f"floor(v_chaincor_u*{finer}*v_chaincor_b/{SAMPLES}+1e-9)"),
        string("e", "ternary(v_chaincor_e<1,1,v_chaincor_e)"),
        string("p", f"v_chaincor_e*round(v_chaincor_u*{finer}/v_chaincor_e)"),
        string("p", "ternary(v_chaincor_p<v_chaincor_e,v_chaincor_e,v_chaincor_p)"),
        string("m", "ternary(v_chaincor_n<1,0,round(v_chaincor_p*v_chaincor_b))"),
    ]
    if change.finer == 1.0:
        # The run as it stands.
        before[5:] = [string("p", "v_chaincor_u"), string("m", "v_chaincor_n")]
    if change.shaken:
        shake = (
            f"displace_atoms all random {change.shaken:.3g} {change.shaken:.3g} 0 4711 units box"
        )
        before.append(
            f'if "${{chaincor_first}} == 1" then "{shake}" "variable chaincor_first string 0"'
        )
    ready = "*".join(["v_chaincor_pre", *_defined(change.quantities)])
    before.append(f'if "$({ready}) > 0" then "include {folder / _SAMPLE}"')
    before.append(
        "timestep $(ternary(v_chaincor_m<1,v_chaincor_dt,v_chaincor_dt*v_chaincor_n/"
        "ternary(v_chaincor_m<1,1,v_chaincor_m)):%.17g)"
    )
    after = [
        f'print "${{chaincor_dt}}" append {folder / STEP_FILE} screen no',
        "timestep ${chaincor_dt}",
        string("shift", "v_chaincor_shift+v_chaincor_m-v_chaincor_n"),
    ]
    columns = " ".join(f"$({each}:%.17g)" for each in ("time", *change.quantities))
    sample = [
        # So that the last sample is that of the end.
        string("from", "step+v_chaincor_m-v_chaincor_e*floor(v_chaincor_m/v_chaincor_e)"),
        "variable chaincor_to string $(step+v_chaincor_m:%.15g)",
        "variable chaincor_at equal stride(${chaincor_from},${chaincor_to},${chaincor_e})",
        f'fix chaincor all print v_chaincor_at "{columns}" append {folder / SAMPLE_FILE} '
        'screen no title ""',
    ]
    if change.frames:
        frames = folder / FRAME_FILE
        sample += [
            'if "$(is_defined(dump,chaincor)) > 0" then "undump chaincor"',
            f"dump chaincor all custom 1 {frames} id xu yu zu",
            "dump_modify chaincor sort id append yes format float %.17g time yes",
            "dump_modify chaincor every v_chaincor_at",
        ]
    return {
        name: "\n".join([*lines, ""])
        for name, lines in ((_BEFORE, before), (_AFTER, after), (_SAMPLE, sample))
    }


def _defined(quantities: tuple[str, ...]) -> list[str]:
    """Return formulas that are 1 where what a quantity refers to is there already."""
    kinds = {"c": "compute", "f": "fix", "v": "variable"}
    return [
        f"is_defined({kinds[each[0]]},{each[2:].split('[')[0]})"
        for each in quantities
        if re.match(r"[cfv]_", each)
    ]


def _set(words: list[str], change: Change) -> list[str]:
    """Give a command the cutoff, skin, table rows and seeds that are wanted."""
    settings, seed = change.settings, change.seed
    if "skin" in settings and words[0] == "neighbor" and len(words) > 1:
        words[1] = settings["skin"]
    if "cutoff" in settings and words[0] == "pair_style" and "hybrid" not in words[1]:
        at = next((k for k, word in enumerate(words[2:], 2) if _is_number(word)), None)
        if at is not None:
            words[at] = settings["cutoff"]
    if "rows" in settings and words[0] in _TABLES and "table" in words[:-2]:
        words[words.index("table") + 2] = settings["rows"]
    if seed is not None:
        at = seed_position(words)
        if at is not None and words[at].isdigit():
            words[at] = str((int(words[at]) + seed) % 900_000_000 + 1)
    return words


def seed_position(words: list[str]) -> int | None:
    """Return which word of a command is a seed; None where it has none."""
    at = _SEEDED_FIXES.get(words[3]) if words[:1] == ["fix"] and len(words) > 4 else None
    for (command, place, style), position in _SEEDED.items():
        if words[:1] == [command] and words[place : place + 1] == [style]:
            at = position
    return at if at is not None and at < len(words) else None


def _scale(words: list[str], finer: float) -> list[str]:
    """Let numbers of steps in a command be so many times larger; returns lines before it."""
    positions = count_positions(words)
    if words[0] == "neigh_modify":
        positions = tuple(
            k + 1 for k in range(1, len(words) - 1, 2) if words[k] in ("every", "delay")
        )
    lines: list[str] = []
    first = ""
    for at in positions:
        count = f"chaincor_c{at}"
        lines.append(f"variable {count} string {words[at]}")
        least = "0" if words[at - 1] == "delay" else "1"
        formula = f"round(v_{count}*{finer:.17g})"
        if first and words[0] == "fix":
            # A multiple of the first, as many times as before.
            formula = f"v_{first}x*round(v_{count}/v_{first})"
        lines.append(f"variable {count}x string $({formula}:%.15g)")
        lines.append(f"variable {count}x string $(ternary(v_{count}x<{least},{least},v_{count}x))")
        words[at] = f"${{{count}x}}"
        first = first or count
    return lines


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True
