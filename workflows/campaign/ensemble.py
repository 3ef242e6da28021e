"""Hold the results of many collisions, and describe their distribution."""

import math
from collections import Counter
from dataclasses import asdict, dataclass, fields
from functools import cached_property
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from chaincor.analysis.distribution import Distribution, Quantile, Share, share_above
from chaincor.analysis.figures.terminal import draw_histogram
from chaincor.analysis.showing.numbers import impact_speed, named_lines
from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.errors import one_line
from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.scene_parts.given_bodies import chain_masses, seed_of
from chaincor.workflows.errors import RunError
from chaincor.workflows.json_output import finite
from chaincor.workflows.result import Collision

DEFAULT_PRECISION = 0.01


@dataclass(frozen=True)
class Sample:
    """Result of one collision in an ensemble."""

    seed: int | None  #: Seed of the scene; None for a cold chain.
    velocity: float  #: Impact speed v0.
    #: Ratio of energies eta; None if the collision gave no result.
    restitution: float | None = None
    restitution_error: float | None = None  #: Error bar of eta; None if there is none.
    kinematic_restitution: float | None = None  #: Kinematic restitution, the square root of eta.
    contacts: int | None = None  #: Number of times that particle 1 hit the wall.
    #: Time of the last contact, counted from the first contact.
    last_contact_time: float | None = None
    ending: str | None = None  #: ``proved``, ``argued`` or ``open``.
    scheme: str | None = None  #: Integration scheme.
    timestep: float | None = None  #: Time step H, if the scheme has one.
    #: Whether the error bar is within the tolerance; None with explicit numerics.
    tolerance_met: bool | None = None
    reason: str | None = None  #: Why the tolerance is missed, or why there is no result.

    @classmethod
    def of(cls, scene: Scene, found: Collision | Exception) -> Self:
        """Return the sample of one collision, from its result or its error."""
        seed = None if scene.temperature is None else seed_of(scene)
        if isinstance(found, Exception):
            return cls(seed, scene.impact_velocity, reason=one_line(found))
        names = [each.name for each in fields(cls)][1:]
        return cls(seed, **{name: getattr(found, name) for name in names})


@dataclass(frozen=True)
class Ensemble:
    r"""
    Result of many collisions.

    If a collision gave no result, the `reason` of its sample says why. Means exclude such samples.

    Attributes
    ----------
    samples : tuple of Sample
        Samples in the order of the scenes or seeds.
    scene : dict
        Fields that are equal in all scenes, as in a scene file.
    tolerance : float or None
        Requested error of each eta; None with explicit numerics.
    workers : int
        Number of collisions at a time. Results do not depend on this number.
    seconds_total : float
        Wall-clock time of all collisions together.
    versions : dict
        Versions of chaincor and of the libraries that computed the results.

    Examples
    --------
    >>> from chaincor import Scene, collide_many
    >>> ensemble = collide_many(Scene(particles=5, temperature=1e-4, engine="reference"), 10)
    >>> ensemble.samples[0].seed, ensemble.failures, bool(ensemble.eta.mean < 1.0)
    (1, (), True)
    """

    samples: tuple[Sample, ...]
    scene: dict[str, Any]
    tolerance: float | None
    workers: int
    seconds_total: float
    versions: dict[str, str]

    @cached_property
    def _sound(self) -> list[Sample]:
        return [sample for sample in self.samples if sample.restitution is not None]

    @property
    def failures(self) -> tuple[Sample, ...]:
        """Samples without a result."""
        return tuple(sample for sample in self.samples if sample.restitution is None)

    @property
    def inexact(self) -> tuple[Sample, ...]:
        """Samples with a result whose error bar exceeds the tolerance."""
        return tuple(sample for sample in self._sound if sample.tolerance_met is False)

    @property
    def restitution(self) -> Array:
        """Values of eta in all samples with a result."""
        return np.array([sample.restitution for sample in self._sound], dtype=float)

    @property
    def restitution_error(self) -> Array:
        """Numerical error bars of eta; nan if a result has no bar."""
        return np.array([sample.restitution_error for sample in self._sound], dtype=float)

    @property
    def kinematic_restitution(self) -> Array:
        """Values of the kinematic restitution e, the square root of eta."""
        return np.sqrt(self.restitution)

    @property
    def kinematic_restitution_error(self) -> Array:
        r"""Error bars of e on their wider side: :math:`\sqrt\eta - \sqrt{\eta - \Delta}`."""
        eta, bar = self.restitution, self.restitution_error
        return np.sqrt(eta) - np.sqrt(np.maximum(eta - bar, 0.0))

    @property
    def contacts(self) -> NDArray[np.int64]:
        """Numbers of contacts in all samples with a result."""
        return np.array([sample.contacts for sample in self._sound], dtype=np.int64)

    @cached_property
    def eta(self) -> Distribution:
        r"""Distribution of :math:`\eta = K_r/K_i`."""
        self._refuse_nothing()
        return Distribution.of(self.restitution, self.restitution_error)

    @cached_property
    def e(self) -> Distribution:
        r"""Distribution of :math:`e = \sqrt\eta`."""
        self._refuse_nothing()
        return Distribution.of(self.kinematic_restitution, self.kinematic_restitution_error)

    @cached_property
    def above_one(self) -> Share:
        """Probability of e > 1, with its confidence interval."""
        self._refuse_nothing()
        return share_above(self.restitution, self.restitution_error, 1.0)

    def _refuse_nothing(self) -> None:
        if not self._sound:
            reason = self.samples[0].reason
            raise RunError(f"none of {len(self.samples)} collisions has a number: {reason}")

    def to_dict(self) -> dict[str, Any]:
        """Return all fields as plain values for JSON; numbers that are not finite become None."""
        plain = {
            "scene": self.scene,
            "count": len(self.samples),
            "failed": len(self.failures),
            "inexact": len(self.inexact),
            "tolerance": self.tolerance,
            "eta": asdict(self.eta),
            "e": asdict(self.e),
            "above_one": asdict(self.above_one),
            "samples": [asdict(sample) for sample in self.samples],
            "workers": self.workers,
            "seconds_total": self.seconds_total,
            "versions": self.versions,
        }
        return {key: finite(value) for key, value in plain.items()}

    def __repr__(self) -> str:
        if not self._sound:
            return f"<Ensemble of {len(self.samples)} collisions, none with a number>"
        eta, above = self.eta, self.above_one
        error = "" if math.isnan(eta.standard_error) else f" +- {eta.standard_error:.1g}"
        return (
            f"<Ensemble of {len(self.samples)} collisions: mean eta {eta.mean:.4g}{error}, "
            f"P(e > 1) {above.value:.3g} ({above.low:.3g} to {above.high:.3g})>"
        )

    def _repr_html_(self) -> str:
        if not self._sound:
            return f"<p>{len(self.samples)} collisions, none with a number</p>"
        above = self.above_one
        cells = "".join(
            f"<tr><th>{name}</th><td>{one}</td><td>{other}</td></tr>"
            for name, one, other in _rows(self.eta, self.e)
        )
        missed = len(self.failures), len(self.inexact)
        return (
            f"<table><caption>{len(self.samples)} collisions, {missed[0]} without a number, "
            f"{missed[1]} beyond the tolerance</caption>"
            "<tr><th></th><th>eta = K_r/K_i</th><th>e = sqrt(eta)</th></tr>"
            f"{cells}<tr><th>P(e &gt; 1)</th><td colspan='2'>{above.value:.3g}, "
            f"{above.low:.3g} to {above.high:.3g} with 95 % confidence</td></tr></table>"
        )


def describe_ensemble(result: Ensemble, scene: Scene, precision: float) -> str:
    """Describe the samples of a warm scene; `precision` is the requested error of the mean eta."""
    eta, e, above = result.eta, result.e, result.above_one
    seeds = [sample.seed for sample in result.samples]
    assert scene.temperature is not None
    thermal = math.sqrt(scene.temperature / float(np.mean(chain_masses(scene))))
    speed = impact_speed(scene.impact_velocity, scene.bond.natural_speed)
    contacts = result.contacts
    lines = [
        f"{len(seeds)} collisions: {scene.particles} particles, {scene.label} bonds, {speed}",
        f"warm at first: T = {scene.temperature:.6g}, seeds {seeds[0]} to {seeds[-1]}; v0 is "
        f"{scene.impact_velocity / thermal:.4g} times the thermal speed of a particle",
        "",
        f"{'':22} {'eta = K_r/K_i':<32}e = sqrt(eta)",
        *(f"{name:22} {one:<32}{other}" for name, one, other in _rows(eta, e)),
    ]
    share = f"{above.value:.4g}, {above.low:.4g} to {above.high:.4g} with 95 % confidence"
    if above.doubtful:
        share += f"; for {above.doubtful} the error bar leaves e > 1 open"
    counts = Counter(sample.scheme for sample in result.samples if sample.scheme is not None)
    schemes = ", ".join(f"{count} {name}" for name, count in sorted(counts.items()))
    endings = [sample.ending for sample in result.samples]
    ends = ", ".join(
        f"{endings.count(kind)} {kind}" for kind in ("proved", "argued", "open") if kind in endings
    )
    hits = f"{np.mean(contacts):.4g} on average, {contacts.min()} to {contacts.max()}"
    rows = {"P(e > 1)": share, "contacts": hits, "ends": ends}
    rows["precision"] = _precision(eta, precision)
    lines += [
        *named_lines(rows.items()),
        "",
        draw_histogram(result.kinematic_restitution, label="e", mark=1.0),
        "",
        f"run by {scene.engine}: {schemes}",
        f"time {result.seconds_total:.3g} s, "
        f"{len(seeds) / result.seconds_total:.3g} collisions a second",
    ]
    return "\n".join(lines)


def _rows(eta: Distribution, e: Distribution) -> list[tuple[str, str, str]]:
    """Return the rows of the table: name, value for eta, value for e."""
    rows = [
        ("mean", _mean(eta), _mean(e)),
        ("numerical error", _bar(eta), _bar(e)),
        ("standard deviation", _number(eta.deviation), _number(e.deviation)),
    ]
    for one, other in zip(eta.quantiles, e.quantiles, strict=True):
        name = f"quantile {100.0 * one.probability:g} %"
        rows.append((name, _interval(one), _interval(other)))
    return rows


def _mean(found: Distribution) -> str:
    if math.isnan(found.standard_error):
        return f"{found.mean:.6g}"
    error, digits = found.standard_error, 15
    if error > 0.0:
        digits = min(max(1, 2 - math.floor(math.log10(error))), 15)
    return f"{found.mean:.{digits}f} +- {error:.1e}"


def _bar(found: Distribution) -> str:
    return "none asked for" if math.isnan(found.numerical_error) else f"{found.numerical_error:.1e}"


def _number(value: float) -> str:
    return "unknown" if math.isnan(value) else f"{value:.4g}"


def _interval(found: Quantile) -> str:
    value, low, high = found.value, found.low, found.high
    between = f"{low:.4g} to {high:.4g}" if math.isfinite(low + high) else "too few samples"
    return f"{value:.4g} ({between})"


def _precision(eta: Distribution, precision: float) -> str:
    needed = eta.samples_needed(precision)
    if needed is None:
        return "one sample does not tell how many are needed"
    if needed <= eta.count:
        return f"mean of eta to {precision:g}: reached with {needed} of these samples"
    return f"mean of eta to {precision:g} needs about {needed - eta.count} more samples"
