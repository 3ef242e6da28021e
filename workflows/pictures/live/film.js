// The film of a run: what pictures of it are made of.

const FRAMES = 600;

/** What can be drawn: displacements, velocities and energies at regular times. */
class Film {
  constructor(setup, stride, until) {
    Object.assign(this, { setup, stride, until, times: [], frames: [] });
  }

  note(motion) {
    if (motion.steps % this.stride || motion.time > this.until) return;
    this.times.push(motion.time);
    this.frames.push([Float32Array.from(motion.displacements()), motion.now.velocity.slice()]);
    if (this.times.length < 2 * FRAMES) return;
    this.stride *= 2; // every other one will do
    this.times = this.times.filter((_, k) => k % 2 === 0);
    this.frames = this.frames.filter((_, k) => k % 2 === 0);
  }

  /** Frames from soon before the first contact to soon after the last one, in one array each. */
  cut(begin, end) {
    const { state, line, speed } = this.setup, lead = 0.06 * (end - begin);
    const first = this.times[0] - begin;
    const [u0, v0] = this.frames[0];
    const times = [], u = [], v = [], step = this.times[1] - this.times[0];
    for (let t = -lead; t < first - step / 2 && first === 0; t += step) {
      // A cold chain in flight, before it touches the wall.
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

/** Translation, vibration (kinetic) and bonds of the chain, and the same of a free target, over K_i. */
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
