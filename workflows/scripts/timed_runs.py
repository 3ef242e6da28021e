"""
A ``run`` at another step, for the same time exactly, with samples of it.

Between runs the script sees its own step, so that what it computes from ``dt`` stays as it was;
around each ``run`` the step is changed for that run alone, to one that divides the run's time.
"""

import re
from pathlib import Path

from chaincor.workflows.scripts.change import Change

# So many samples of a run are wanted.
SAMPLES = 200
SAMPLE_FILE, FRAME_FILE = "chaincor_samples.txt", "chaincor_frames.txt"
STEP_FILE = "chaincor_step.txt"
_BEFORE, _AFTER, _SAMPLE = "chaincor_before.in", "chaincor_after.in", "chaincor_sample.in"


def timed_run(words: list[str], folder: Path) -> list[str]:
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


def included_files(folder: Path, change: Change) -> dict[str, str]:
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
