// The pictures of one collision, and the curve over the speed.

/** What the pictures show: the run and all that follows from it, the curve, the moment. */
const shown = { run: null, curve: [], speed: null, harmonic: false };

const TIME = "time since the first contact (\u221a(m/k))";

/** Prepare a run for drawing: places, strains, which bonds are broken in which frame. */
function readyRun(run, scene) {
  const { times, displacements: u, velocities: v } = run.film;
  const count = run.masses.length, { first } = run, gap = first - 1, bond = bondOf(scene);
  const rest = Float32Array.from({ length: count }, (_, i) => (i < first ? i - gap : i - first));
  const broken = [], before = new Uint8Array(count - 1);
  let scale = 0, reach = 0, lowest = 0, squeeze = 0;
  times.forEach((_, k) => {
    const at = k * count, strainOf = (i) => u[at + i + 1] - u[at + i];
    const opening = (i) => (v[at + i + 1] - v[at + i]) * run.speed;
    const now = brokenBonds(bond, gap, run.masses, strainOf, opening, count - 1);
    for (let i = 0; i < count - 1; i++) {
      // Once broken it is until it comes back to where it pulls more with its length.
      if (before[i] && strainOf(i) > bond.convex) now[i] = 1;
      before[i] = now[i];
      if (i !== gap) scale = Math.max(scale, Math.min(-strainOf(i), 1));
      if (i !== gap) squeeze = Math.max(squeeze, -strainOf(i));
      reach = Math.max(reach, Math.abs(u[at + i + 1]));
    }
    lowest = Math.min(lowest, rest[0] + u[at]);
    broken.push(now);
  });
  let highest = 0;
  for (let k = 0; k < times.length; k++)
    highest = Math.max(highest, rest[count - 1] + u[k * count + count - 1]);
  const rigid = !(scene.target_particles > 0);
  const magnification = Math.max(1, Math.min(0.8 / squeeze, 0.4 * count / reach));
  return { ...run, count, gap, bond, rest, broken, lowest: rigid ? 0 : lowest, highest, rigid,
           scale: scale || 1e-12, magnification };
}

/** Colour of a strain: short bonds and long ones to either side of the paper. */
function strainColours() {
  const parse = (hex) => [1, 3, 5].map((k) => parseInt(hex.slice(k, k + 2), 16));
  const [paper, short, long] = ["canvas", "short", "long"].map((name) => parse(colour(name)));
  return (part) => {
    const to = part < 0 ? short : long, share = Math.min(1, Math.abs(part)) ** 0.7;
    return paper.map((p, k) => Math.round(p + share * (to[k] - p)));
  };
}

/** World lines over the strain of the bonds, which shows the sound. */
const worldLines = new Picture("world-lines", {
  paint(axes) {
    const run = shown.run;
    if (!run) return;
    const { times, displacements: u } = run.film, { count, rest } = run;
    const margin = 0.03 * (run.highest - run.lowest);
    axes.span(times[0], times[times.length - 1], run.lowest - (run.rigid ? 0 : margin),
      run.highest + margin);
    const { pen, ratio, left, top } = axes, [width, height] = axes.inner.map(Math.floor);
    const columns = Math.max(1, Math.round(width * ratio)), rows = Math.round(height * ratio);
    const image = pen.createImageData(columns, rows), paint = strainColours();
    let k = 0;
    for (let column = 0; column < columns; column++) {
      const time = axes.x0 + (axes.x1 - axes.x0) * (column + 0.5) / columns;
      while (k + 1 < times.length && times[k + 1] <= time) k++;
      const at = k * count, place = (i) => rest[i] + u[at + i];
      let i = 0, last = -1, rgb = null;
      for (let row = rows - 1; row >= 0; row--) {
        const x = axes.y0 + (axes.y1 - axes.y0) * (rows - row - 0.5) / rows;
        while (i + 1 < count && place(i + 1) <= x) i++;
        if (x < place(0) || i + 1 >= count || i === run.gap) continue;
        const broken = run.broken[k][i];
        if (i !== last) {
          rgb = broken ? paint(1) : paint((u[at + i + 1] - u[at + i]) / run.scale);
          last = i;
        }
        // Hatched where nothing holds.
        if (broken && (column + row) % Math.round(7 * ratio) > 1.2 * ratio) continue;
        const pixel = 4 * (row * columns + column);
        [image.data[pixel], image.data[pixel + 1], image.data[pixel + 2]] = rgb;
        image.data[pixel + 3] = 255;
      }
    }
    pen.putImageData(image, Math.round(left * ratio), Math.round(top * ratio));
    const stride = Math.max(1, Math.round(count / 40));
    for (let i = 0; i < count; i++) {
      const target = i < run.first;
      if (i !== run.first && i !== count - 1 && (i - run.first) % stride) continue;
      if (target && run.rigid) continue;
      const points = times.map((time, k) => [time, rest[i] + u[k * count + i]]);
      axes.line(points, target ? "target" : "lines", i === run.first ? 1.6 : 0.8);
    }
    axes.axes(TIME, "position (bond lengths)", { grid: false });
    if (run.rigid) {
      pen.fillStyle = colour("ink");
      pen.fillRect(left, axes.y(0), width, 4);
    }
  },
  overlay(axes, moment) {
    const run = shown.run;
    if (!run) return;
    const { pen, top } = axes, x = axes.x(moment.time), [width, height] = axes.inner;
    pen.globalAlpha = 0.72;
    pen.fillStyle = colour("canvas");
    pen.fillRect(x, top, axes.left + width - x, height - 1);
    pen.globalAlpha = 1;
    axes.line([[moment.time, axes.y0], [moment.time, axes.y1]], "mark", 2);
  },
});

/** The chain itself, and how fast each particle goes. */
const chainPicture = new Picture("chain", {
  bottom: 88,
  paint(axes) {
    const run = shown.run;
    if (!run) return;
    const m = run.magnification, count = run.count;
    let low = run.lowest, high = 1;
    for (let k = 0; k < run.film.times.length; k++) {
      const at = k * count;
      high = Math.max(high, run.rest[count - 1] + m * run.film.displacements[at + count - 1]);
      low = Math.min(low, run.rest[0] + m * run.film.displacements[at]);
    }
    axes.span(run.rigid ? 0 : low - 0.5, high + 0.5, -2.2, 2.2);
    axes.axes(m > 1.2 ? `position (bond lengths; displacements \u00d7 ${m.toPrecision(2)})`
      : "position (bond lengths)", "velocity / v\u2080");
    axes.line([[axes.x0, 0], [axes.x1, 0]], "ink", 1);
  },
  overlay(axes, moment) {
    const run = shown.run;
    if (!run) return;
    const { pen } = axes, { count, first, rest, magnification: m } = run;
    const { displacements: u, velocities: v } = run.film, at = moment.frame * count;
    const base = axes.high - 40, paint = strainColours();
    const begin = run.rigid ? first : 0, x = (i) => axes.x(rest[i] + m * u[at + i]);
    const room = axes.inner[0] / Math.max(1, count), size = Math.min(7, Math.max(1.2, 0.3 * room));
    if (run.rigid) {
      pen.fillStyle = colour("ink");
      pen.fillRect(axes.left - 6, base - 22, 6, 32);
    }
    for (let i = begin; i + 1 < count; i++) {
      if (i === run.gap) continue;
      const [a, b] = [x(i), x(i + 1)], strain = u[at + i + 1] - u[at + i];
      pen.lineWidth = Math.max(2, 0.7 * size);
      if (run.broken[moment.frame][i]) {
        // Two loose ends.
        pen.strokeStyle = colour("mark");
        pen.lineWidth = 2;
        pen.beginPath();
        const end = Math.min(0.3 * (b - a), size + 7);
        pen.moveTo(a, base);
        pen.lineTo(a + end, base - 5);
        pen.moveTo(b, base);
        pen.lineTo(b - end, base + 5);
        pen.stroke();
        continue;
      }
      const [red, green, blue] = paint(strain / run.scale);
      pen.strokeStyle = colour("faint");
      pen.beginPath();
      if (room > 14) {
        // A spring.
        pen.lineWidth = 1.5;
        pen.strokeStyle = Math.abs(strain / run.scale) < 0.25 ? colour("faint")
          : `rgb(${red} ${green} ${blue})`;
        const coils = 8, begin = a + size, length = b - a - 2 * size;
        pen.moveTo(begin, base);
        for (let k = 1; k < coils; k++)
          pen.lineTo(begin + length * k / coils, base + (k % 2 ? -4 : 4));
        pen.lineTo(begin + length, base);
      } else {
        pen.lineWidth = Math.max(4, size);
        pen.strokeStyle = `rgb(${red} ${green} ${blue})`;
        pen.moveTo(a, base);
        pen.lineTo(b, base);
      }
      pen.stroke();
    }
    pen.strokeStyle = colour("lines");
    pen.lineWidth = 1;
    pen.beginPath();
    for (let i = first; i < count; i++)
      pen[i > first ? "lineTo" : "moveTo"](x(i), axes.y(clamp(v[at + i], -2.2, 2.2)));
    pen.stroke();
    for (let i = begin; i < count; i++) {
      const name = i < first ? "target" : v[at + i] < 0 ? "incoming" : "outgoing";
      const own = size * Math.min(2, Math.max(0.6, run.masses[i] ** (1 / 3)));
      axes.dot(x(i), base, own, name);
      axes.dot(x(i), axes.y(clamp(v[at + i], -2.2, 2.2)), Math.min(4, Math.max(1.2, size)), name);
    }
  },
});

const clamp = (x, low, high) => Math.min(high, Math.max(low, x));

/** Where the energy is, stacked. */
const energyPicture = new Picture("energy", {
  paint(axes) {
    const run = shown.run;
    if (!run) return;
    const { times, energies } = run.film;
    let most = 1;
    for (const parts of energies) most = Math.max(most, parts.reduce((a, b) => a + b, 0));
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
    axes.axes(TIME, "energy / energy of flight before", { grid: false });
  },
  overlay: cursor,
});

/** A line at the moment shown. */
function cursor(axes, moment) {
  if (shown.run) axes.line([[moment.time, axes.y0], [moment.time, axes.y1]], "mark", 2);
}

/** Hits so far, with the speeds at which particle 1 comes. */
const contactPicture = new Picture("contacts", {
  paint(axes) {
    const run = shown.run;
    if (!run) return;
    const { times } = run.film, most = Math.max(1, ...run.contacts.map(([, speed]) => speed));
    axes.span(times[0], times[times.length - 1], 0, 1.1 * most);
    axes.axes(TIME, "speed of approach / v\u2080");
    axes.line([[axes.x0, 1], [axes.x1, 1]], "faint", 1, [4, 4]);
    for (const [time, speed] of run.contacts)
      axes.dot(axes.x(time), axes.y(speed), 2.5, "faint", false);
  },
  overlay(axes, moment) {
    if (!shown.run) return;
    for (const [time, speed] of shown.run.contacts)
      if (time <= moment.time) axes.dot(axes.x(time), axes.y(speed), 3.2, "lines");
    cursor(axes, moment);
  },
});

/** Energies of the modes, now and after the last contact. */
const spectrumPicture = new Picture("spectrum", {
  left: 64,
  paint(axes) {
    const run = shown.run;
    if (!run) return;
    const n = run.count - run.first;
    axes.span(0, n, -8, 0.3);
    axes.axes(`mode j (wavelength 2n/j bond lengths)`, "energy / energy of flight before",
      { logarithmic: true });
    const left = Array.from(run.spectrum, (e, j) => [j, Math.max(-8, Math.log10(e))]).slice(1);
    axes.line(left.length > 1 ? left : [[0.9, left[0][1]], [1.1, left[0][1]]], "faint", 1);
  },
  overlay(axes, moment) {
    const run = shown.run;
    if (!run) return;
    const { count, first, speed, modes } = run, n = count - first;
    const at = moment.frame * count + first, end = at + n;
    const masses = run.masses.slice(first), mass = masses.reduce((a, b) => a + b);
    const u = run.film.displacements.subarray(at, end), v = run.film.velocities.subarray(at, end);
    // Of a chain that broke, modes of motion alone mean something.
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

/** The restitution at all speeds, point by point. */
const curvePicture = new Picture("curve", {
  paint(axes) {
    const known = shown.curve.filter((point) => point.restitution !== undefined);
    const etas = known.map((point) => point.restitution);
    const low = Math.min(0.6, ...etas.map((eta) => Math.floor(10 * eta) / 10));
    const high = Math.max(1, ...etas.map((eta) => Math.ceil(10 * eta) / 10));
    const most = shown.harmonic ? 0.5 : 2;
    axes.span(0, most, Math.max(0, low), high + 0.02);
    axes.axes(shown.harmonic ? "impact speed (\u221a(k/m) bond lengths)" : "impact speed / v*",
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
