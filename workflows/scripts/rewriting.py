"""
Rewrite a user's script for one run of a study.

The new script has another timestep but covers the same simulated time, writes samples, and writes
no dumps. Only commands that run steps, write frames, or set a varied quantity are edited. Each
``run`` gets its own step, which divides its simulated time evenly. Between runs the script's own
step is restored, so formulas with ``dt`` keep their values.
"""

import re
from pathlib import Path

from chaincor.lammps_inputs.commands import join_lines
from chaincor.workflows.scripts.change import Change

# Each run takes about this many samples.
SAMPLES = 200
SAMPLE_FILE, FRAME_FILE = "chaincor_samples.txt", "chaincor_frames.txt"
START_FILE, STEP_FILE = "chaincor_start.txt", "chaincor_step.txt"
_BEFORE, _AFTER, _SAMPLE = "chaincor_before.in", "chaincor_after.in", "chaincor_sample.in"
_LEFT_OUT = ("dump", "undump", "dump_modify", "restart")
# This command without effect replaces a dropped command.
_NOTHING = "variable chaincor_none string 0"
_NO_VALUES = ("loop", "delete", "world", "universe", "uloop")
_RESETS = ("reset_timestep", "read_restart")
_LARGEST = 10_000_000
# These columns of the thermo output are replaced, because fixes may lack a value when a run ends.
_REPLACED = re.compile(r"[fv]_")
_QUOTED = re.compile(r"\"([^\"]*)\"|'([^']*)'")


def rewrite_folder(folder: Path, script: Path, change: Change) -> None:
    """Rewrite the copied script and the files that it may include, and add files."""
    for path in folder.rglob("*"):
        if path == script or _may_be_included(path):
            path.write_text(rewrite(path.read_text("utf-8", "replace"), folder, change), "utf-8")
    names = ("shift", "first", "begun", "run")
    head = "".join(f"variable chaincor_{name} string 0\n" for name in names)
    script.write_text(head + script.read_text("utf-8"), "utf-8")
    for name, text in included_files(folder, change).items():
        (folder / name).write_text(text, "utf-8")


def _may_be_included(path: Path) -> bool:
    if not path.is_file() or path.stat().st_size > _LARGEST or path.suffix in (".py", ".md"):
        return False
    data = path.read_bytes()
    return b"\0" not in data[:4096] and bool(re.search(rb"(?m)^\s*(run|variable|fix|dump)\s", data))


def rewrite(text: str, folder: Path, change: Change) -> str:
    """Return the text of a script after its commands were changed."""
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
    """Rewrite a command in quotes, for example after ``then``."""
    quote, text = found[0][0], found[1] if found[1] is not None else found[2]
    commands = _command(text, folder, change)
    return " ".join(f"{quote}{each}{quote}" for each in commands or [_NOTHING])


def _command(command: str, folder: Path, change: Change) -> list[str]:
    """Return the commands that replace one command."""
    words = command.split()
    if not words:
        return [command]
    name = words[0]
    if name == "run" and len(words) > 1:
        if change.restart is not None and change.restart.reads:
            limits = ("start", change.restart.start), ("stop", change.restart.end)
            words += [f"{key} {value}" for key, value in limits if key not in words]
            words = " ".join(words).split()
        return timed_run(words, folder)
    if name in _LEFT_OUT:
        return []
    if change.restart is not None and change.restart.reads:
        replaced = change.restart.replace_set_up(words)
        if replaced is not None:
            return replaced
    if name in _RESETS:
        return [command, "variable chaincor_shift string 0"]
    is_value = name == "variable" and len(words) > 2 and words[2] not in _NO_VALUES
    if is_value and words[1] in change.variables:
        return [f"variable {words[1]} index {change.variables[words[1]]}"]
    before = change.set_numbers(words)
    if words[:2] == ["thermo_style", "custom"]:
        if not change.printed:
            # LAMMPS prints the values of many fixes only at multiples of their period, but a run
            # with another step seldom ends at a multiple. Such a value is therefore replaced by a
            # word that keeps the number of columns.
            words = ["time" if _REPLACED.match(word) else word for word in words]
        # LAMMPS can evaluate only those thermo keywords that are in its output.
        keywords = [each for each in change.quantities if not re.match(r"[cfv]_", each)]
        words += [each for each in keywords if each not in words]
    if name == "thermo_modify" and not change.printed:
        words = _without_replaced(words)
    return [*before, " ".join(words)] if before or words != command.split() else [command]


def _without_replaced(words: list[str]) -> list[str]:
    """Remove the settings of replaced columns from a thermo_modify command."""
    kept, at = [], 0
    while at < len(words):
        column = "".join(words[at + 1 : at + 2])
        if words[at] in ("colname", "format") and _REPLACED.match(column):
            at += 3
        else:
            kept.append(words[at])
            at += 1
    return kept if len(kept) > 1 else [_NOTHING]


def timed_run(words: list[str], folder: Path) -> list[str]:
    """Return a run command, and commands around it that set the step and the number of steps."""
    options, limits = ["run", "${chaincor_m}"], {}
    upto, block, pre = False, "${chaincor_n}", True
    rest = iter(words[2:])
    for word in rest:
        if word == "upto":
            upto = True
        elif word == "every":
            block = next(rest, "")
            options += ["every", "${chaincor_p}", *rest]
        else:
            value = next(rest, "")
            if word in ("start", "stop"):
                limits[word], value = value, f"${{chaincor_{word}}}"
            pre = pre and not (word == "pre" and value == "no")
            options += [word, value]
    lines = [f"variable chaincor_n string {words[1]}"]
    if upto:
        lines.append("variable chaincor_n string $(v_chaincor_n-step+v_chaincor_shift:%.15g)")
    lines += [
        f"variable chaincor_u string {block}",
        f"variable chaincor_pre string {int(pre)}",
        f"include {folder / _BEFORE}",
    ]
    for word, value in limits.items():
        name = f"chaincor_{word}"
        # A rounded limit must not lie before the end of the run.
        least = "0" if word == "start" else "step+v_chaincor_m"
        lines += [
            f"variable {name} string {value}",
            f"variable {name} string $(round(step+(v_{name}-step+v_chaincor_shift)*v_chaincor_p/"
            "v_chaincor_u):%.15g)",
            f"variable {name} string $(ternary(v_{name}<{least},{least},v_{name}):%.15g)",
        ]
    return [*lines, " ".join(options), f"include {folder / _AFTER}"]


def included_files(folder: Path, change: Change) -> dict[str, str]:
    """Return the files that scripts include before and after each run."""
    finer = f"{change.finer:.17g}"

    def string(name: str, formula: str, form: str = ":%.15g") -> str:
        return f"variable chaincor_{name} string $({formula}{form})"

    before = [
        string("dt", "dt", ":%.17g"),
        f'print "${{chaincor_dt}} $(step) ${{chaincor_n}}" append {folder / STEP_FILE} screen no',
        string("u", "ternary(v_chaincor_u<1,1,v_chaincor_u)"),
        string("b", "ternary(v_chaincor_n<v_chaincor_u,1,v_chaincor_n/v_chaincor_u)"),
        string("e", f"floor(v_chaincor_u*{finer}*v_chaincor_b/{SAMPLES}+1e-9)"),
        string("e", "ternary(v_chaincor_e<1,1,v_chaincor_e)"),
        string("p", f"v_chaincor_e*round(v_chaincor_u*{finer}/v_chaincor_e)"),
        string("p", "ternary(v_chaincor_p<v_chaincor_e,v_chaincor_e,v_chaincor_p)"),
        string("m", "ternary(v_chaincor_n<1,0,round(v_chaincor_p*v_chaincor_b))"),
    ]
    if change.finer == 1.0:
        # With these commands, the numbers of steps stay as in the script.
        before[6:] = [string("p", "v_chaincor_u"), string("m", "v_chaincor_n")]
    if change.shaken:
        shake = (
            f"displace_atoms all random {change.shaken:.3g} {change.shaken:.3g} 0 4711 units box"
        )
        before.append(
            f'if "${{chaincor_first}} == 0" then "{shake}" "variable chaincor_first string 1"'
        )
    before.append(string("run", "v_chaincor_run+1"))
    ready = "*".join(["v_chaincor_pre", *_defined(change.quantities)])
    halfway = change.restart
    if halfway is not None and not halfway.reads:
        before += halfway.before()
    elif halfway is not None:
        # Runs before the restart have no steps.
        this = f"(v_chaincor_run=={halfway.run})"
        before.append(string("m", f"{this}*({halfway.end}-step)"))
        before.append(string("n", "v_chaincor_m"))
        ready += f"*{this}"
    before += change.extra
    before.append(f'if "$({ready}) > 0" then "include {folder / _SAMPLE}"')
    before.append(
        "timestep $(ternary(v_chaincor_m<1,v_chaincor_dt,v_chaincor_dt*v_chaincor_n/"
        "ternary(v_chaincor_m<1,1,v_chaincor_m)):%.17g)"
    )
    after = [
        "timestep ${chaincor_dt}",
        'if "$(is_defined(fix,chaincor_start)) > 0" then "unfix chaincor_start"',
        string("shift", "v_chaincor_shift+v_chaincor_m-v_chaincor_n"),
    ]
    columns = " ".join(f"$({each}:%.17g)" for each in ("time", *change.quantities))
    columns = columns.replace(" ", " $(step) ", 1) if change.quantities else columns + " $(step)"
    start = [f"v_chaincor_s{k}" for k in range(1 + len(change.quantities))]
    sample = [
        # The last sample is taken at the end of the run.
        string("from", "step+v_chaincor_m-v_chaincor_e*floor(v_chaincor_m/v_chaincor_e)"),
        "variable chaincor_to string $(step+v_chaincor_m:%.15g)",
        "variable chaincor_at equal stride(${chaincor_from},${chaincor_to},${chaincor_e})",
        f'fix chaincor all print v_chaincor_at "{columns}" append {folder / SAMPLE_FILE} '
        'screen no title ""',
        # `fix print` skips the first step. `fix ave/time` therefore writes the first sample. The
        # period of `fix ave/time` is chosen so that no later step is a multiple of it, except twice
        # the step of a restart.
        string("period", "ternary(step<1,1000000000,step)"),
        *(
            f"variable {name[2:]} equal {each}"
            for name, each in zip(start, ("time", *change.quantities), strict=True)
        ),
        'if "${chaincor_begun} == 0" then "variable chaincor_begun string 1" '
        f'"fix chaincor_start all ave/time ${{chaincor_period}} 1 ${{chaincor_period}} '
        f"{' '.join(start)} format ' %.17g' file {folder / START_FILE}\"",
    ]
    if any(each.startswith("f_") for each in change.quantities):
        # At the first step, a fix may not have a value yet.
        sample.pop()
    if change.frames:
        frames = folder / FRAME_FILE
        sample += [
            'if "$(is_defined(dump,chaincor)) > 0" then "undump chaincor"',
            f"dump chaincor all custom 1 {frames} id xu yu zu vx vy vz",
            "dump_modify chaincor sort id append yes first yes format float %.17g time yes",
            "dump_modify chaincor every v_chaincor_at",
        ]
    return {
        name: "\n".join([*lines, ""])
        for name, lines in ((_BEFORE, before), (_AFTER, after), (_SAMPLE, sample))
    }


def _defined(quantities: tuple[str, ...]) -> list[str]:
    """Return formulas that are 1 if the compute, fix or variable in them exists."""
    kinds = {"c": "compute", "f": "fix", "v": "variable"}
    return [
        f"is_defined({kinds[each[0]]},{each[2:].split('[')[0]})"
        for each in quantities
        if re.match(r"[cfv]_", each)
    ]
