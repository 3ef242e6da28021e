"""The frozen result of many collisions: every sample, and their distribution."""

import math
from dataclasses import asdict, dataclass, fields
from functools import cached_property
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from chaincor.analysis.distribution import Distribution, Share, share_above
from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.scene_parts.given_bodies import seed_of
from chaincor.workflows.campaign.ensemble_text import rows_of
from chaincor.workflows.errors import RunError
from chaincor.workflows.json_output import finite
from chaincor.workflows.result import Collision


@dataclass(frozen=True)
class Sample:
    """One collision of many."""

    seed: int | None  #: Of what its scene draws; None of a cold chain.
    velocity: float  #: Impact speed v0.
    #: eta and its numerical error bar; None where there is no number, or no bar.
    restitution: float | None = None
    restitution_error: float | None = None  #: See ``restitution``.
    kinematic_restitution: float | None = None  #: e, the root of eta.
    contacts: int | None = None  #: How often particle 1 hit the wall.
    last_contact_time: float | None = None  #: From the first contact.
    ending: str | None = None  #: ``proved``, ``argued`` or ``open``.
    scheme: str | None = None  #: How it was integrated.
    timestep: float | None = None  #: H, where there is one.
    #: Whether the error bar is within the tolerance; None with explicit numerics.
    tolerance_met: bool | None = None
    reason: str | None = None  #: Why it is not, or why there is no number.

    @classmethod
    def of(cls, scene: Scene, found: Collision | Exception) -> Self:
        """Return the sample of one collision, or of the error that it failed with."""
        seed = None if scene.temperature is None else seed_of(scene)
        if isinstance(found, Exception):
            return cls(seed, scene.impact_velocity, reason=" ".join(str(found).split()))
        names = [each.name for each in fields(cls)][1:]
        return cls(seed, **{name: getattr(found, name) for name in names})


@dataclass(frozen=True)
class Ensemble:
    r"""
    Result of many collisions.

    Those without a number, whose samples say why, are left out of all means.

    Attributes
    ----------
    samples : tuple of Sample
        In the order of the scenes, or of the seeds.
    scene : dict
        What all scenes say, as a scene file does.
    tolerance : float or None
        Error asked of each eta; None with explicit numerics.
    workers : int
        How many collisions were carried out at a time; no number depends on it.
    seconds_total : float
        Wall-clock time of everything.
    versions : dict
        Versions of chaincor and of the libraries behind the numbers.

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
        """Samples without a number."""
        return tuple(sample for sample in self.samples if sample.restitution is None)

    @property
    def inexact(self) -> tuple[Sample, ...]:
        """Samples with a number whose bar is wider than the tolerance."""
        return tuple(sample for sample in self._sound if sample.tolerance_met is False)

    @property
    def restitution(self) -> Array:
        """Eta of the samples that have one."""
        return np.array([sample.restitution for sample in self._sound], dtype=float)

    @property
    def restitution_error(self) -> Array:
        """Numerical error bars; nan where there is none."""
        return np.array([sample.restitution_error for sample in self._sound], dtype=float)

    @property
    def kinematic_restitution(self) -> Array:
        """E, the root of eta."""
        return np.sqrt(self.restitution)

    @property
    def kinematic_restitution_error(self) -> Array:
        r"""Error bars of e: :math:`\sqrt\eta - \sqrt{\eta - \Delta}`, the wider side."""
        eta, bar = self.restitution, self.restitution_error
        return np.sqrt(eta) - np.sqrt(np.maximum(eta - bar, 0.0))

    @property
    def contacts(self) -> NDArray[np.int64]:
        """Of the samples that have a number."""
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
        """How likely a collision gives more translational energy than there was."""
        self._refuse_nothing()
        return share_above(self.restitution, self.restitution_error, 1.0)

    def _refuse_nothing(self) -> None:
        if not self._sound:
            reason = self.samples[0].reason
            raise RunError(f"none of {len(self.samples)} collisions has a number: {reason}")

    def to_dict(self) -> dict[str, Any]:
        """Return everything, ready for JSON; numbers that are not finite become None."""
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
            for name, one, other in rows_of(self.eta, self.e)
        )
        missed = len(self.failures), len(self.inexact)
        return (
            f"<table><caption>{len(self.samples)} collisions, {missed[0]} without a number, "
            f"{missed[1]} beyond the tolerance</caption>"
            "<tr><th></th><th>eta = K_r/K_i</th><th>e = sqrt(eta)</th></tr>"
            f"{cells}<tr><th>P(e &gt; 1)</th><td colspan='2'>{above.value:.3g}, "
            f"{above.low:.3g} to {above.high:.3g} with 95 % confidence</td></tr></table>"
        )
