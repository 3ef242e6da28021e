"""
Spoil tables of known functions in 16 ways, and judge them against the functions.

Run: python -m tests.workflows.tables.spoiled [--tolerance 0.01] [--seed 1] [--kind KIND]

For each kind of fault, the program prints how many of 25 spoiled tables are called good although
the error of LAMMPS's force exceeds the tolerance. It also prints how many sound tables are refused.
"""

import argparse
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from chaincor import check_table
from chaincor.workflows.tables.lammps_run import run_lammps

_UNIT = np.pi / 180.0
_POINTS = 1500


def _lennard_jones(depth=1.0, m=12, n=6):
    scale = depth * m / (m - n) * (m / n) ** (n / (m - n))
    return (
        lambda r: scale * (r**-m - r**-n),
        lambda r: scale * (m * r**-m - n * r**-n) / r,
    )


def _morse(depth, steepness):
    def x(r):
        return np.exp(-steepness * (r - 1.0))

    return (
        lambda r: depth * (1.0 - x(r)) ** 2,
        lambda r: -2.0 * depth * steepness * (1.0 - x(r)) * x(r),
    )


def _harmonic(stiffness, centre=1.0):
    return (
        lambda r: 0.5 * stiffness * (r - centre) ** 2,
        lambda r: -stiffness * (r - centre),
    )


def _fene(r):
    return -0.5 * 30.0 * 2.25 * np.log(1.0 - (r / 1.5) ** 2) + 4.0 * (r**-12 - r**-6)


def _fene_force(r):
    return -30.0 * r / (1.0 - (r / 1.5) ** 2) + 24.0 * (2.0 * r**-13 - r**-7)


def _yukawa(strength, reach):
    return (
        lambda r: strength * np.exp(-r / reach) / r,
        lambda r: strength * np.exp(-r / reach) * (1.0 / r + 1.0 / reach) / r,
    )


def _buckingham(r):
    return 1e5 * np.exp(-12.0 * r) - 1.0 / r**6


def _buckingham_force(r):
    return 1.2e6 * np.exp(-12.0 * r) - 6.0 / r**7


def _gauss(r):
    return 5.0 * np.exp(-(r**2)) - np.exp(-((r - 2.0) ** 2) * 4.0)


def _gauss_force(r):
    return 10.0 * r * np.exp(-(r**2)) - 8.0 * (r - 2.0) * np.exp(-((r - 2.0) ** 2) * 4.0)


def _cosines(*terms):
    return (
        lambda a: sum(k * (1.0 + np.cos(n * a * _UNIT - d)) for k, n, d in terms),
        lambda a: sum(k * n * _UNIT * np.sin(n * a * _UNIT - d) for k, n, d in terms),
    )


@dataclass(frozen=True)
class Case:
    """A table of a known function."""

    name: str
    kind: str
    energy: object
    force: object
    low: float
    high: float
    rows: int
    header: str = ""  #: R or RSQ
    slopes: bool = True
    style: str = "spline"
    form: str = "%.12g"

    def columns(self):
        if self.kind == "dihedral":
            r = np.linspace(self.low, self.high, self.rows + 1)[:-1]
        elif self.header == "RSQ":
            r = np.sqrt(np.linspace(self.low**2, self.high**2, self.rows))
        else:
            r = np.linspace(self.low, self.high, self.rows)
        return np.transpose([r, self.energy(r), self.force(r)])


def _case(name, kind, functions, low, high, rows, **more):
    return Case(name, kind, *functions, low, high, rows, **more)


SOUND = [
    # Hard cores.
    _case("lj", "pair", _lennard_jones(), 0.8, 2.5, 500, header="R"),
    _case("lj from 0.6", "pair", _lennard_jones(), 0.6, 3.0, 2000, header="R"),
    _case("lj in squares", "pair", _lennard_jones(), 0.8, 2.5, 800, header="RSQ"),
    _case("lj linear", "pair", _lennard_jones(), 0.8, 2.5, 3000, header="RSQ", style="linear"),
    _case("lj without R", "pair", _lennard_jones(), 0.85, 2.5, 400),
    _case("lj 9-6", "pair", _lennard_jones(1.0, 9, 6), 0.75, 3.0, 400, header="R"),
    _case("lj bond", "bond", _lennard_jones(4.0), 0.85, 2.0, 300),
    _case("buckingham", "pair", (_buckingham, _buckingham_force), 0.7, 3.0, 500, header="R"),
    _case("fene", "bond", (_fene, _fene_force), 0.7, 1.4, 400),
    # Deep wells.
    _case("deep lj", "pair", _lennard_jones(50.0), 0.8, 3.0, 800, header="R"),
    _case("deep morse", "bond", _morse(100.0, 2.0), 0.6, 2.0, 300),
    _case("stiff bond", "bond", _harmonic(1000.0), 0.8, 1.2, 200),
    _case("steep morse", "bond", _morse(200.0, 6.0), 0.8, 1.5, 400),
    # Long ranges.
    _case("lj to 10", "pair", _lennard_jones(), 0.85, 10.0, 4000, header="R"),
    _case("yukawa", "pair", _yukawa(10.0, 1.0), 0.5, 12.0, 2000, header="R"),
    _case("gauss", "pair", (_gauss, _gauss_force), 0.05, 8.0, 1000, header="R"),
    _case("morse to 4", "bond", _morse(5.0, 2.0), 0.6, 4.0, 600),
    # Few rows.
    _case("few lj", "pair", _lennard_jones(), 0.9, 2.5, 120, header="R"),
    _case("few morse", "bond", _morse(1.0, 2.0), 0.6, 2.0, 40),
    _case("few harmonic", "bond", _harmonic(30.0), 0.5, 1.5, 20),
    _case("few rows of an angle", "angle", _cosines((3.0, 1.0, 0.0)), 0.0, 180.0, 37),
    # Angles.
    _case("angle", "angle", _harmonic(0.01, 110.0), 0.0, 180.0, 361),
    _case("cosines", "angle", _cosines((5.0, 1.0, 0.3), (2.0, 3.0, 0.0)), 0.0, 180.0, 181),
    _case("dihedral", "dihedral", _cosines((2.0, 3.0, 0.3)), -180.0, 180.0, 180),
    _case(
        "three cosines",
        "dihedral",
        _cosines((1.0, 1.0, 0.0), (0.5, 2.0, 1.0), (2.0, 3.0, 0.0)),
        0.0,
        360.0,
        360,
    ),
]


def write(case, path, data, slopes=None):
    """Write a table; `slopes` are the end slopes of the force, if the case has them."""
    header = f"N {len(data)}"
    if case.header:
        header += f" {case.header} {case.low:.12g} {case.high:.12g}"
    if case.slopes and case.kind != "dihedral":
        if slopes is None:
            step = 1e-6 * (case.high - case.low)
            ends = [(case.low, step), (case.high, -step)]
            slopes = [float(case.force(x + h) - case.force(x)) / h for x, h in ends]
        word = "FPRIME" if case.kind == "pair" else "FP"
        header += f" {word} {slopes[0]:.9g} {slopes[1]:.9g}"
    if case.kind == "dihedral":
        header += " DEGREES"
    body = [f"{k} " + " ".join(case.form % x for x in row) for k, row in enumerate(data, 1)]
    path.write_text("\n".join(["KEY", header, "", *body, ""]))


def _size(rng, low, high):
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def _place(case, data, rng):
    """Return a row at a length that particles reach."""
    inside = np.flatnonzero(data[:, 1] <= np.min(data[:, 1]) + 8.0)
    inside = inside[(inside > 5) & (inside < len(data) - 6)]
    return int(rng.choice(inside)) if len(inside) else len(data) // 2


def _few_rows(case, data, rng):
    case = replace(case, rows=max(int(case.rows / _size(rng, 5.0, 40.0)), 8))
    return case, case.columns(), None


def _few_digits(case, data, rng):
    return replace(case, form=f"%.{rng.integers(1, 5)}g"), data, None


def _noise(case, data, rng):
    size = _size(rng, 0.003, 1.0) * local_size(case.force, data[:, 0])
    return case, data + np.outer(size * rng.normal(size=len(data)), [0, 0, 1]), None


def _one_sided(case, data, rng):
    case = replace(case, rows=max(int(case.rows / _size(rng, 1.0, 10.0)), 10))
    data = case.columns()
    slopes = -np.diff(data[:, 1]) / np.diff(data[:, 0])
    ends = slopes[-1:] if rng.random() < 0.5 else slopes[:1]
    data[:, 2] = np.append(slopes, ends) if ends[0] == slopes[-1] else np.append(ends, slopes)
    return case, data, None


def _outlier(case, data, rng):
    row = _place(case, data, rng)
    size = _size(rng, 0.05, 3.0) * local_size(case.force, data[:, 0])[row]
    data[row, 2] += size * rng.choice([-1.0, 1.0])
    return case, data, None


def _step(case, data, rng):
    row = _place(case, data, rng)
    data[row:, 2] += _size(rng, 0.03, 3.0) * local_size(case.force, data[:, 0])[row]
    return case, data, None


def _factor(case, data, rng):
    known = [4.184, 10.0, 23.060548, 96.485332, 0.5, 2.0, 1.8897261, 1.1, 1.03]
    factor = float(rng.choice(known)) ** rng.choice([-1, 1])
    data[:, rng.choice([1, 2])] *= factor
    return case, data, None


def _sign(case, data, rng):
    data[:, rng.choice([1, 2])] *= -1.0
    return case, data, None


def _sign_beyond(case, data, rng):
    row = _place(case, data, rng)
    data[row:, 2] *= -1.0
    return case, data, None


def _exchanged(case, data, rng):
    return case, data[:, [0, 2, 1]], None


def _shifted(case, data, rng):
    rows = int(rng.choice([-3, -2, -1, 1, 2, 3]))
    data[:, 2] = np.roll(data[:, 2], rows)
    if rows > 0:
        data[:rows, 2] = data[rows, 2]
    else:
        data[rows:, 2] = data[rows - 1, 2]
    return case, data, None


def _r_squared(case, data, rng):
    data[:, 0] **= 2
    if case.header and rng.random() < 0.5:
        # The header has the range of the column.
        return replace(case, header="R", low=case.low**2, high=case.high**2), data, (0.0, 0.0)
    return case, data, None


def _other_forces(case, data, rng):
    span = case.high - case.low
    moved = data[:, 0] + _size(rng, 0.002, 0.1) * span * rng.choice([-1.0, 1.0])
    data[:, 2] = case.force(np.clip(moved, case.low, case.high))
    return case, data, None


def _slopes(case, data, rng):
    slopes = np.diff(data[[0, 1, -2, -1], 2])[[0, 2]] / np.diff(data[[0, 1, -2, -1], 0])[[0, 2]]
    wrong = slopes * rng.choice([-1.0, 3.0, 30.0, 0.0])
    return replace(case, slopes=True), data, tuple(wrong)


def _rounded_lengths(case, data, rng):
    step = case.high - case.low
    decimals = int(np.ceil(-np.log10(step * _size(rng, 1e-4, 2e-2))))
    data[:, 0] = np.round(data[:, 0], decimals)
    keep = np.append(True, np.diff(data[:, 0]) > 0.0)
    return case, data[keep], None


def _gap(case, data, rng):
    row, rows = _place(case, data, rng), int(len(data) * _size(rng, 0.05, 0.4))
    kept = np.delete(data, slice(row, min(row + rows, len(data) - 4)), axis=0)
    return replace(case, header=""), kept, None


FAULTS = {
    "few rows": _few_rows,
    "few digits": _few_digits,
    "noise": _noise,
    "one-sided difference": _one_sided,
    "outlier": _outlier,
    "step": _step,
    "factor": _factor,
    "sign": _sign,
    "sign beyond": _sign_beyond,
    "exchanged columns": _exchanged,
    "shifted column": _shifted,
    "r squared": _r_squared,
    "other forces": _other_forces,
    "slopes": _slopes,
    "rounded lengths": _rounded_lengths,
    "gap": _gap,
}


def local_size(exact, at):
    """Return the largest force within 5 % of the range, but at least 0.001 of the maximum."""
    low, high = np.min(at), np.max(at)
    fine = np.linspace(low, high, 4001)
    forces = np.abs(exact(fine))
    width = 0.05 * (high - low)
    around = np.stack([np.interp(at + s, fine, forces) for s in np.linspace(-width, width, 81)])
    return np.maximum(np.max(around, axis=0), 1e-3 * np.max(forces))


def true_error(report, exact):
    """Return the largest error of the modelled force in a report's range."""
    judge = report.curves
    at = judge.places(*report.range)
    force = judge.curve(report.style, report.style_rows).force(at)
    return float(np.max(np.abs(force - exact(at)) / local_size(exact, at)))


def error_of_lammps(case, path, report, span):
    """Return the largest error of the installed LAMMPS in the range of the sound table."""
    low = max(span[0], report.low) if np.isfinite(report.low) else span[0]
    high = min(span[1], report.high) if np.isfinite(report.high) else span[1]
    if not low < high:
        return np.inf
    edge = 1e-6 * (high - low)
    period = 360.0
    given = run_lammps(
        path,
        "KEY",
        case.kind,
        case.style,
        report.rows,
        (low + edge, high - edge),
        _POINTS,
        period=period,
    )
    if given.error:
        return np.inf
    at = given.lengths[:-1]
    off = np.abs(given.forces[:-1] - case.force(at))
    return float(np.max(off / np.interp(at, *_sizes(case, span))))


def error_of_model(case, path, report, span):
    """Return the largest error of the model of LAMMPS, which is faster."""
    if report.curves is None:
        return np.inf
    low, high = max(span[0], report.low), min(span[1], report.high)
    if not low < high:
        return np.inf
    at = np.linspace(low, high, _POINTS)[:-1]
    off = np.abs(report.curves.curve(report.style, report.style_rows).force(at) - case.force(at))
    return float(np.max(off / np.interp(at, *_sizes(case, span))))


def _sizes(case, span):
    fine = np.linspace(*span, 2001)
    return fine, local_size(case.force, fine)


def judged(
    folder, names=tuple(FAULTS), *, tolerance=0.01, seed=1, cases=SOUND, reference_value=None
):
    """Yield the kind of fault, the case, the true error and the report of each spoiled table."""
    reference_value = reference_value or error_of_lammps
    path = Path(folder) / "t.table"
    for number, sound in enumerate(cases):
        write(sound, path, sound.columns())
        whole = check_table(path, kind=sound.kind, style=sound.style, tolerance=tolerance)
        yield "sound", sound, reference_value(sound, path, whole, whole.range), whole
        for name in names:
            rng = np.random.default_rng([seed, number, list(FAULTS).index(name)])
            case, data, slopes = FAULTS[name](sound, sound.columns(), rng)
            write(case, path, data, slopes)
            report = check_table(path, kind=sound.kind, style=sound.style, tolerance=tolerance)
            yield name, sound, reference_value(sound, path, report, whole.range), report


def main():
    parser = argparse.ArgumentParser(description="Judge spoiled tables.")
    parser.add_argument("--tolerance", type=float, default=0.01)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--kind", choices=FAULTS, action="append")
    parser.add_argument("--model", action="store_true", help="the model in place of LAMMPS")
    options = parser.parse_args()
    names = options.kind or tuple(FAULTS)
    counts = {name: [0, 0, 0, 0] for name in ("sound", *names)}
    with tempfile.TemporaryDirectory() as folder:
        reference_value = error_of_model if options.model else error_of_lammps
        for name, case, true, report in judged(
            folder,
            names,
            tolerance=options.tolerance,
            seed=options.seed,
            reference_value=reference_value,
        ):
            wrong = true > options.tolerance
            row = counts[name]
            row[0] += 1
            row[1] += wrong
            row[2] += wrong and report.is_good
            row[3] += not wrong and not report.is_good
            said = "nothing" if report.error is None else f"{report.error:.3g}"
            if (wrong and report.is_good) or (name == "sound" and not report.is_good):
                print(f"{name:<21} {case.name:<21} true {true:.3g}, said {said}: {report.summary}")
    print("kind                  tables  wrong  of these called good  right but refused")
    for name, row in counts.items():
        print(f"{name:<21} {row[0]:>6} {row[1]:>6} {row[2]:>21} {row[3]:>18}")
    spoiled = [row for name, row in counts.items() if name != "sound"]
    total, wrong, missed = (sum(row[k] for row in spoiled) for k in (0, 1, 2))
    print(f"{missed} of {total} spoiled tables are called good and wrong ({wrong} are wrong)")


if __name__ == "__main__":
    main()
