"""Draw pictures of one result: ``result.plot.world_lines()`` and others."""

import base64
import tempfile
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.bonds.potentials import is_harmonic
from chaincor.lammps_inputs.errors import InputError
from chaincor.workflows.motion import ResultMotion

if TYPE_CHECKING:
    from matplotlib.axes import Axes


@dataclass(frozen=True)
class MovingPicture:
    """GIF that a notebook plays."""

    data: bytes  #: Contents of the GIF file.

    def save(self, path: Path | str) -> Path:
        """Write the GIF to a file, and return its path."""
        from chaincor.analysis.atomic_write import written_aside

        with written_aside(Path(path)) as aside:
            aside.write_bytes(self.data)
        return Path(path)

    def __repr__(self) -> str:
        return f"<animation, {len(self.data) / 1000:.0f} kB; .save('FILE.gif') writes it to a file>"

    def _repr_html_(self) -> str:
        return f'<img src="data:image/gif;base64,{base64.b64encode(self.data).decode()}">'


class Plots:
    """
    Pictures of a result.

    Each method draws into the ``matplotlib.axes.Axes`` given as `ax`, or into a new figure, and
    returns the axes. A notebook shows the picture below the cell. In a script,
    ``ax.figure.savefig("lines.png")`` writes the picture to a file, and ``plt.show()`` shows it if
    pyplot was imported before. Methods that draw the motion compute the collision again.
    """

    def __init__(self, result: ResultMotion) -> None:
        self._result = result

    def __repr__(self) -> str:
        return "<plots: world_lines(), spectrum(), energy(), contacts(), animate()>"

    def world_lines(
        self, ax: "Axes | None" = None, *, magnification: float | None = None
    ) -> "Axes":
        """
        Draw positions against time, contacts, and the sound wave from the first contact.

        Parameters
        ----------
        ax : matplotlib.axes.Axes, optional
            Axes for the picture.
        magnification : float, optional
            Factor by which displacements are enlarged; by default, it is chosen to make them
            visible.

        Raises
        ------
        InputError, RunError
            If the motion cannot be computed again (see ``result.trajectory``), or if the
            magnification is not a positive finite number.
        """
        from chaincor.analysis.figures.trajectories import plot_trajectories

        result = self._result
        times, places, _, targets = self._motion
        return plot_trajectories(
            times,
            places,
            contact_times=result.contact_times,
            sound_speed=self._lightness**0.5,
            end_time=float(times[-1]),
            magnification=magnification,
            targets=targets,
            ax=self._axes(ax),
        )

    def spectrum(self, ax: "Axes | None" = None) -> "Axes":
        """
        Draw the energy of each mode of the chain after the collision.

        For a broken chain, the picture shows kinetic energies, because the potential energy of a
        broken bond belongs to no mode. For a harmonic chain of equal masses that hits a hard wall
        without vibrations, the picture also shows the theory of Basile and Dumont, which assumes
        that all contacts are alike.

        Raises
        ------
        InputError
            If the chain has only one particle, or bonds that only push. Such chains have no modes.
        """
        from chaincor.analysis.figures.modes import plot_spectrum
        from chaincor.analysis.modes import kinetic_mode_energies

        result = self._result
        if result.particles == 1:
            raise InputError("a single particle has no modes. Use a chain of 2 or more")
        if not len(result.mode_energies):
            raise InputError(
                f"{result.potential} beads have no stiffness at rest and therefore no "
                "modes. Draw world_lines or energy"
            )
        energies, theory = result.mode_energies, None
        if result.fragments > 1:
            energies = kinetic_mode_energies(result.velocities, self._masses)
        elif not self._special and is_harmonic(result.potential):
            theory = self._theory()
        axes = self._axes(ax)
        plot_spectrum(energies, self._energy_before, theory=theory, ax=axes)
        if result.fragments > 1:
            axes.set_ylabel(r"share of the energy, kinetic part $p_j^2/2E$")
        return axes

    def energy(self, ax: "Axes | None" = None) -> "Axes":
        """
        Draw translational and vibrational energy against time, relative to the energy at impact.

        If the target is free, each energy is the sum over both bodies. During a soft contact, the
        fractions do not add up to 1, because the contact stores the rest of the energy.

        Raises
        ------
        InputError, RunError
            If the motion cannot be computed again, see ``result.trajectory``.
        """
        from chaincor.analysis.figures.time_series import plot_energy_partition

        result = self._result
        bodies = [b for b in (result.history, result.target_history) if b is not None]
        translation = np.sum([body.translation for body in bodies], axis=0)
        vibration = np.sum([body.vibration for body in bodies], axis=0)
        times = bodies[0].series_times
        # The curve starts with the value before the first contact, because a hard contact changes
        # the translational energy at once.
        whole = float(translation[0] + vibration[0])
        before = 0.5 * float(np.sum(self._masses)) * result.velocity**2
        begin = min(float(times[0]), -0.05 * result.last_contact_time)
        return plot_energy_partition(
            np.concatenate(([begin, float(times[0])], times)),
            np.concatenate(([before, before], translation)),
            np.concatenate(([whole - before, whole - before], vibration)),
            whole,
            last_contact=result.last_contact_time,
            ax=self._axes(ax),
        )

    def contacts(
        self, quantity: Literal["intervals", "speeds"] = "intervals", ax: "Axes | None" = None
    ) -> "Axes":
        """
        Draw the intervals between contacts, or the incoming speeds of particle 1.

        Parameters
        ----------
        quantity : str
            ``intervals`` or ``speeds``.
        ax : matplotlib.axes.Axes, optional
            Axes for the picture.

        Raises
        ------
        InputError
            If the quantity is neither ``intervals`` nor ``speeds``.
        """
        from chaincor.analysis.figures.time_series import (
            plot_contact_intervals,
            plot_contact_speeds,
        )

        result = self._result
        if quantity not in ("intervals", "speeds"):
            raise InputError(f"quantity is {quantity!r}. Use intervals or speeds")
        alike = not self._special
        axes = self._axes(ax)
        if quantity == "speeds":
            return plot_contact_speeds(
                result.contact_speeds, result.velocity, pair_line=alike, ax=axes
            )
        stiffness = self._lightness if alike else None
        return plot_contact_intervals(result.contact_times, stiffness=stiffness, ax=axes)

    def animate(
        self, path: Path | str | None = None, *, pictures: int = 120
    ) -> "MovingPicture | Path":
        """
        Make an animation of the particles' velocities, with the chain itself below.

        Parameters
        ----------
        path : pathlib.Path or str, optional
            ``.gif``, or ``.mp4`` with ffmpeg.
        pictures : int
            Number of pictures, which are shown at 25 per second.

        Returns
        -------
        MovingPicture or pathlib.Path
            An animation that a notebook plays, or the path of the file if `path` is given.

        Raises
        ------
        InputError, RunError
            If the file has another suffix, if `pictures` is not a positive whole number, or if the
            motion cannot be computed again.
        """
        from chaincor.analysis.figures.animation import animate_collision

        times, places, speeds, targets = self._motion

        def write(file: Path | str) -> Path:
            return animate_collision(
                times,
                places,
                speeds,
                file,
                impact_velocity=self._result.velocity,
                frames=pictures,
                title=self._caption,
                targets=targets,
            )

        if path is not None:
            return write(path)
        with tempfile.TemporaryDirectory(prefix="chaincor-") as folder:
            return MovingPicture(write(Path(folder) / "collision.gif").read_bytes())

    @property
    def _motion(self) -> tuple[Array, Array, Array, int]:
        """Return times, displacements and velocities along x, and the size of the target."""
        chain, target = self._result.history, self._result.target_history
        places, speeds = chain.along_the_line(target)
        return chain.times, places, speeds, self._result.target_particles or 0

    @cached_property
    def _masses(self) -> Array:
        return np.resize(np.array(self._result.masses or (1.0,)), self._result.particles)

    @property
    def _lightness(self) -> float:
        """Return the square of the speed of sound, the stiffness divided by the mean mass."""
        return (self._result.stiffness or 1.0) / float(np.mean(self._masses))

    @property
    def _special(self) -> bool:
        """Return whether the scene gives masses, vibrations, a target or a soft contact."""
        return self._result.velocity_after is not None

    @property
    def _energy_before(self) -> float:
        """Return the energy of the chain before the impact, including its vibrations."""
        result = self._result
        translation = 0.5 * float(np.sum(self._masses)) * result.velocity**2
        if result.temperature is None and result.initial is None and result.compression is None:
            return translation
        if result.vibrational_energy is None or result.translational_energy is None:
            return translation
        if result.target_particles is None:
            # The wall takes no energy, so the energy after the collision equals the energy before.
            return result.translational_energy + result.vibrational_energy
        return float(result.history.translation[0] + result.history.vibration[0])

    def _theory(self) -> Array | None:
        from chaincor.analysis.contacts import contact_statistics
        from chaincor.analysis.theory import measured_contacts_energies

        r = self._result
        found = contact_statistics(r.contact_times, r.contact_speeds, r.particles, r.velocity)
        stiffness = r.stiffness or 1.0
        return measured_contacts_energies(r.particles, found, r.velocity, stiffness=stiffness)

    def _axes(self, ax: "Axes | None") -> "Axes":
        if ax is not None:
            return ax
        from chaincor.analysis.figures.style import SETTINGS
        from chaincor.analysis.showing.notebook import session_axes

        axes = session_axes(SETTINGS)
        axes.figure.suptitle(self._caption, x=0.01, ha="left", fontsize=9)
        return axes

    @property
    def _caption(self) -> str:
        result = self._result
        speed = f"$v_0$ = {result.velocity:.4g}"
        if result.speed is not None:
            speed = f"$v_0$ = {result.speed:.4g} $v^*$"
        other = "" if result.target_particles is None else f" onto {result.target_particles}"
        name = result.potential.replace("$", r"\$")
        return f"{name}, $n$ = {result.particles}{other}, {speed}"
