// Graphs beside the motion: energies, contacts, modes, and the curve over the speed.

/** Stacked energies against time. */
const energyPicture = new RunPicture("energy", {
  paint(axes, run) {
    const { times, energies } = run.film;
    let most = 1;
    for (const parts of energies) most = Math.max(most, sumOf(parts));
    axes.span(times[0], times[times.length - 1], 0, 1.04 * most);
    const { pen } = axes, below = times.map(() => 0);
    const names = ["translation", "motion", "bonds", "target-translation", "target-motion",
                   "target-bonds"];
    names.slice(0, energies[0].length).forEach((name, part) => {
      pen.beginPath();
      times.forEach((t, k) => pen[k ? "lineTo" : "moveTo"](axes.x(t), axes.y(below[k])));
      for (let k = times.length - 1; k >= 0; k--) {
        below[k] += energies[k][part];
        pen.lineTo(axes.x(times[k]), axes.y(below[k]));
      }
      pen.closePath();
      pen.fillStyle = colour(name);
      pen.fill();
    });
    axes.axes(TIME, "energy / translational energy before", { grid: false });
  },
  overlay: cursor,
});

/** Contacts so far, with the incoming speeds of particle 1. */
const contactPicture = new RunPicture("contacts", {
  paint(axes, run) {
    const { times } = run.film, most = Math.max(1, ...run.contacts.map(([, speed]) => speed));
    axes.span(times[0], times[times.length - 1], 0, 1.1 * most);
    axes.axes(TIME, "speed of approach / v\u2080");
    axes.line([[axes.x0, 1], [axes.x1, 1]], "faint", 1, [4, 4]);
    for (const [time, speed] of run.contacts)
      axes.dot(axes.x(time), axes.y(speed), 2.5, "faint", false);
  },
  overlay(axes, run, moment) {
    for (const [time, speed] of run.contacts)
      if (time <= moment.time) axes.dot(axes.x(time), axes.y(speed), 3.2, "lines");
    cursor(axes, run, moment);
  },
});

/** Energies of the modes, at the moment shown and after the last contact. */
const spectrumPicture = new RunPicture("spectrum", {
  left: 64,
  paint(axes, run) {
    const n = run.count - run.first;
    axes.span(0, n, -8, 0.3);
    axes.axes(`mode j (wavelength 2n/j bond lengths)`, "energy / translational energy before",
      { logarithmic: true });
    const left = Array.from(run.spectrum, (e, j) => [j, Math.max(-8, Math.log10(e))]).slice(1);
    if (left.length === 1) left.splice(0, 1, [0.9, left[0][1]], [1.1, left[0][1]]);
    axes.line(left, "faint", 1); // a single particle has no modes
  },
  overlay(axes, run, moment) {
    const { count, first, speed, modes } = run, n = count - first;
    const at = moment.frame * count + first, end = at + n;
    const masses = run.masses.slice(first), mass = sumOf(masses);
    const u = run.film.displacements.subarray(at, end), v = run.film.velocities.subarray(at, end);
    // If the chain broke, only the kinetic energies of modes have a meaning.
    const apart = run.broken[moment.frame].some((b) => b), unit = 0.5 * mass;
    const still = apart ? new Float32Array(n) : u.map((x) => x / speed);
    shown.energies = modeEnergies(modes, masses, still, v, shown.energies?.length === n
      ? shown.energies : undefined);
    for (let j = 1; j < n; j++) {
      const power = Math.log10(shown.energies[j] / unit);
      if (power > -8) axes.dot(axes.x(j), axes.y(power), n > 120 ? 1.4 : 2.4, "lines");
    }
  },
});

/** Restitution against speed, point by point. */
const curvePicture = new Picture("curve", {
  paint(axes) {
    const known = shown.curve.filter((point) => point.restitution !== undefined);
    const etas = known.map((point) => point.restitution);
    const low = Math.min(0.6, ...etas.map((eta) => Math.floor(10 * eta) / 10));
    const high = Math.max(1, ...etas.map((eta) => Math.ceil(10 * eta) / 10));
    const most = shown.linear ? 0.5 : 2;
    axes.span(0, most, Math.max(0, low), high + 0.02);
    axes.axes(shown.linear ? "impact speed (bond lengths \u00d7 \u221a(k/m))" : "impact speed / v*",
      "restitution \u03b7 (energy)");
    const points = known.slice().sort((a, b) => a.speed - b.speed);
    if (shown.flat && points.length)
      axes.line([[0, points[0].restitution], [most, points[0].restitution]], "lines", 2);
    else axes.line(points.map((p) => [p.speed, p.restitution]), "lines", 1, [2, 3]);
    for (const point of points) {
      const [x, y] = [axes.x(point.speed), axes.y(point.restitution)];
      if (point.error > 0.002) {
        const half = Math.min(point.error, 1);
        axes.line([[point.speed, point.restitution - half], [point.speed, point.restitution + half]],
          "lines", 1);
      }
      axes.dot(x, y, 3.4, "lines", point.ending !== "open");
    }
    for (const point of shown.curve.filter((p) => p.refused)) {
      const { pen } = axes, x = axes.x(point.speed), y = axes.y(axes.y0) - 8;
      pen.strokeStyle = colour("mark");
      pen.lineWidth = 1.5;
      pen.beginPath();
      for (const side of [-1, 1]) {
        pen.moveTo(x - 3.5, y - 3.5 * side);
        pen.lineTo(x + 3.5, y + 3.5 * side);
      }
      pen.stroke();
    }
  },
  overlay(axes) {
    const run = shown.run;
    if (!run || axes.x0 === undefined) return;
    const speed = run.unit ? run.speed / run.unit : run.speed;
    if (speed > axes.x1) return;
    axes.dot(axes.x(speed), axes.y(run.restitution), 7, "mark", false);
  },
});

const PICTURES = [worldLines, chainPicture, energyPicture, contactPicture, spectrumPicture,
                  curvePicture];
