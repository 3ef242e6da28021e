// Film of a run: the data for its pictures.

const FRAMES = 600;

/** Displacements, velocities and energies at regular times. */
class Film {
  constructor(setup, stride, until) {
    Object.assign(this, { setup, stride, until, times: [], frames: [] });
  }

  note(motion) {
    if (motion.steps % this.stride || motion.time > this.until) return;
    this.times.push(motion.time);
    this.frames.push([Float32Array.from(motion.displacements()), motion.now.velocity.slice()]);
    if (this.times.length < 2 * FRAMES) return;
    this.stride *= 2; // keep every second frame
    this.times = this.times.filter((_, k) => k % 2 === 0);
    this.frames = this.frames.filter((_, k) => k % 2 === 0);
  }

  /**
   * Return the frames from shortly before the first contact until `end`, with one array for each
   * quantity.
   */
  cut(begin, end) {
    const { state, line, speed } = this.setup, lead = 0.06 * (end - begin);
    const first = this.times[0] - begin;
    const [u0, v0] = this.frames[0];
    const times = [], u = [], v = [], step = this.times[1] - this.times[0];
    for (let t = -lead; t < first - step / 2 && first === 0; t += step) {
      // Before the first contact, a cold chain flies without forces.
      times.push(t);
      u.push(u0.map((x, i) => x + state.velocities[i] * t));
      v.push(Float64Array.from(state.velocities));
    }
    this.times.forEach((time, k) => {
      if (time < begin - lead || time > end) return;
      times.push(time - begin);
      u.push(this.frames[k][0]);
      v.push(this.frames[k][1]);
    });
    const count = line.masses.length, flat = (list, unit) => {
      const all = new Float32Array(times.length * count);
      list.forEach((one, k) => all.set(unit === 1 ? one : one.map((x) => x / unit), k * count));
      return all;
    };
    const energies = u.map((_, k) => partition(this.setup, u[k], v[k]));
    return { times, displacements: flat(u, 1), velocities: flat(v, speed), energies };
  }
}

/**
 * Return the energies of translation, internal motion and bonds of the chain, and of a free target,
 * divided by K_i.
 */
function partition({ line, bond, speed }, u, v) {
  const split = (begin, end) => {
    const mean = meanOf(v, line.masses, begin, end);
    let mass = 0, motion = 0, held = 0;
    for (let i = begin; i < end; i++) {
      mass += line.masses[i];
      motion += 0.5 * line.masses[i] * (v[i] - mean) ** 2;
      if (i + 1 < end) held += bond.energy(u[i + 1] - u[i]);
    }
    return [0.5 * mass * mean * mean, motion, held];
  };
  const particles = line.masses.length;
  const mass = sumOf(line.chain);
  const parts = split(line.first, particles);
  if (!line.rigid) parts.push(...split(0, line.first));
  return parts.map((part) => part / (0.5 * mass * speed * speed));
}
