"""Read the sampled series of a run, and compute means, drifts and fluctuations."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from chaincor.analysis.ladders.series import standard_error
from chaincor.lammps_inputs.arrays import Array
from chaincor.workflows.errors import RunError
from chaincor.workflows.scripts.quantities import ObservedNumber, Quantity

# Means are taken over this last fraction of a run.
SHARE = 0.5
# A drift, or the error of a mean, needs at least this many samples.
LEAST_SAMPLES = 8


@dataclass(frozen=True)
class Samples:
    """Time series of quantities in one run."""

    #: Physical times from the start of the first ``run`` to the end of the last, of shape (S,).
    times: Array
    values: dict[str, Array]  #: Series of each quantity, of shape (S,).

    @property
    def end(self) -> float:
        """Physical time at the end of the run."""
        return float(self.times[-1])

    def window(self, kind: str) -> tuple[float, float]:
        """Return the times of the first and the last sample that quantities of this kind use."""
        first, last = float(self.times[0]), self.end
        if kind == "last":
            return last, last
        return (last - SHARE * (last - first) if kind == "mean" else first), last

    def number(self, quantity: Quantity, start: float | None = None) -> ObservedNumber:
        """
        Return the value of a quantity, and for a mean its error.

        The error of a mean allows for the correlation between samples. The window begins at the
        physical time `start`, if given, or at its default time.
        """
        all_values = self.values[quantity.what]
        if quantity.kind == "last":
            return ObservedNumber(float(all_values[-1]))
        times, values = self._inside(quantity, start)
        # Sample times depend on the time step. The trapezoidal rule makes means independent of the
        # sample times.
        halves = 0.5 * np.diff(times)
        weights = np.append(halves, 0.0) + np.append(0.0, halves)
        weights /= weights.sum()
        mean = float(weights @ values)
        if quantity.kind == "mean":
            error, independent = standard_error(values)
            return ObservedNumber(mean, error=error, independent=independent)
        from_middle = times - weights @ times
        slope = float((weights * from_middle) @ values / (weights @ from_middle**2))
        if quantity.kind == "drift":
            return ObservedNumber(slope * float(np.ptp(times)))
        return ObservedNumber(float(np.sqrt(weights @ (values - mean - slope * from_middle) ** 2)))

    def spread(self, quantity: Quantity, what: str = "") -> float:
        """Return the standard deviation of a quantity's samples, or of those of `what`."""
        return float(np.std(self._inside(quantity, None, what)[1]))

    def _inside(
        self, quantity: Quantity, start: float | None, what: str = ""
    ) -> tuple[Array, Array]:
        """Return times and values within the window; the first value is interpolated."""
        all_values = self.values[what or quantity.what]
        first = self.window(quantity.kind if quantity.kind != "last" else "mean")[0]
        start = first if start is None else max(start, float(self.times[0]))
        span = self.end - float(self.times[0])
        # The sample times have rounding errors, because they are sums of steps.
        inside = self.times > start + 1e-9 * span
        times = np.concatenate([[start], self.times[inside]])
        return times, np.concatenate(
            [[np.interp(start, self.times, all_values)], all_values[inside]]
        )


def last_step(path: Path) -> int | None:
    """Return the last sampled step of a run; None if there are no samples."""
    lines = path.read_text("utf-8", "replace").splitlines() if path.is_file() else []
    words = lines[-1].split() if lines else []
    return int(words[1]) if len(words) > 1 and words[1].isdigit() else None


def read_samples(path: Path, start: Path, quantities: tuple[str, ...]) -> Samples:
    """
    Read the samples of a run from a file with one line per sample: time, step and quantities.

    The file `start` has a line with the time and the quantities at the first step. If ``clear``
    sets the time back to 0, later times are shifted to follow the earlier ones. Raise RunError if
    samples are missing, too few or not finite.
    """
    if not path.is_file():
        raise RunError(
            "no sample was taken, because the quantity was not defined during any "
            "'run' of the script. Define its computes, fixes and variables before "
            "a 'run'"
        )
    count = len(quantities)
    words = [line.split() for line in path.read_text("utf-8").splitlines()]
    rows = [[float(each) for each in (row[0], *row[2:])] for row in words if len(row) == 2 + count]
    first = (
        [line.split() for line in start.read_text("utf-8").splitlines()] if start.is_file() else []
    )
    if rows and first and len(first[-1]) == 2 + count and float(first[-1][1]) < rows[0][0]:
        rows.insert(0, [float(each) for each in first[-1][1:]])
    data = np.array(rows).reshape(-1, 1 + count)
    if len(data) < LEAST_SAMPLES:
        raise RunError(f"only {len(data)} samples were taken. Run at least {LEAST_SAMPLES} steps")
    for what, column in zip(quantities, data.T[1:], strict=True):
        if not np.all(np.isfinite(column)):
            raise RunError(
                f"{what} is {column[~np.isfinite(column)][0]} in the run. "
                "Correct the script, or lower the time step"
            )
    steps = np.diff(data[:, 0])
    times = data[0, 0] + np.concatenate([[0.0], np.cumsum(np.where(steps > 0.0, steps, 0.0))])
    # The first sample of each run repeats the last sample of the previous run.
    kept = np.concatenate([[True], np.diff(times) > 0.0])
    values = {what: data[kept, k] for k, what in enumerate(quantities, 1)}
    return Samples(times[kept], values)
