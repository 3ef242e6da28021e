// Pictures of the motion: world lines, and the chain itself.

/** Data that the pictures show: a run with derived data, and the curve. */
const shown = { run: null, curve: [], speed: null, linear: false };

const TIME = "time since the first contact (\u221a(m/k))";

/**
 * Picture of the run; empty if there is no run. Its parts receive the run as a further argument.
 */
class RunPicture extends Picture {
  constructor(id, { paint, overlay, ...margins }) {
    const ofRun = (part) => (axes, moment) => shown.run && part(axes, shown.run, moment);
    super(id, { paint: ofRun(paint), overlay: ofRun(overlay), ...margins });
  }
}

/** Draw a line at the moment shown. */
function cursor(axes, run, moment) {
  axes.line([[moment.time, axes.y0], [moment.time, axes.y1]], "mark", 2);
}

/** Prepare a run for drawing: positions, strains, and the broken bonds in each frame. */
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
      // A broken bond stays broken until its strain falls below the end of the convex part of U.
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

/**
 * Return the colours of strains, from compressed through the background colour to stretched bonds.
 */
function strainColours() {
  const parse = (hex) => [1, 3, 5].map((k) => parseInt(hex.slice(k, k + 2), 16));
  const [paper, short, long] = ["canvas", "short", "long"].map((name) => parse(colour(name)));
  return (part) => {
    const to = part < 0 ? short : long, share = Math.min(1, Math.abs(part)) ** 0.7;
    return paper.map((p, k) => Math.round(p + share * (to[k] - p)));
  };
}

/** World lines, on a background that shows the strain of the bonds and thereby the sound. */
const worldLines = new RunPicture("world-lines", {
  paint(axes, run) {
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
        // Broken bonds are hatched.
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
  overlay(axes, run, moment) {
    const { pen, top } = axes, x = axes.x(moment.time), [width, height] = axes.inner;
    pen.globalAlpha = 0.72;
    pen.fillStyle = colour("canvas");
    pen.fillRect(x, top, axes.left + width - x, height - 1);
    pen.globalAlpha = 1;
    cursor(axes, run, moment);
  },
});

/** The chain, and the velocity of each particle. */
const chainPicture = new RunPicture("chain", {
  bottom: 88,
  paint(axes, run) {
    const m = run.magnification, count = run.count;
    let low = run.lowest, high = 1;
    for (let k = 0; k < run.film.times.length; k++) {
      const at = k * count;
      high = Math.max(high, run.rest[count - 1] + m * run.film.displacements[at + count - 1]);
      low = Math.min(low, run.rest[0] + m * run.film.displacements[at]);
    }
    axes.span(run.rigid ? 0 : low - 0.5, high + 0.5, -2.2, 2.2);
    // Magnified displacements do not give positions on the axis, which then has no numbers.
    const larger = m > 1.2;
    find("chain-scale").textContent = larger
      ? `displacements drawn ${Number(m.toPrecision(2))} times as large` : "";
    axes.axes(larger ? "position" : "position (bond lengths)", "velocity / v\u2080",
      { numbers: !larger });
    axes.line([[axes.x0, 0], [axes.x1, 0]], "ink", 1);
  },
  overlay(axes, run, moment) {
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
        // A broken bond is drawn as two loose ends.
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
        // An intact bond is drawn as a spring.
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
