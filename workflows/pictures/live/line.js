// Integrate two bodies on a line by symmetric compositions of Verlet steps. Contacts are located to
// within rounding on the composed map, as in workflows/engines/reference.
//
// Particles are ordered along x, from the far end of the target to the far end of the chain. Bonds
// join neighbours, except across the gap, where contacts occur. A rigid wall is one particle of
// infinite mass.

// Smallest interval in the search for a contact, as a fraction of the step.
const NARROWEST = 2 ** -20;
const MOST_CONTACTS_IN_A_STEP = 64;
// Number of particles on either side that can affect the contact within a step: each stage adds
// one.
const NEAR = KICKS.length + 1;

/** A scene that the page cannot compute, with a message for the reader. */
class Refusal extends Error {}

const sumOf = (numbers) => numbers.reduce((a, b) => a + b, 0);

/** Return the mean over the particles from `begin` to `end`, weighted by mass. */
function meanOf(values, masses, begin = 0, end = masses.length) {
  let mass = 0, sum = 0;
  for (let i = begin; i < end; i++) {
    mass += masses[i];
    sum += masses[i] * values[i];
  }
  return sum / mass;
}

/**
 * Return the displacements of successive particles, from the first displacement and the strains of
 * the bonds.
 */
function displacementsOf(strains, first = 0) {
  const u = new Float64Array(strains.length + 1);
  u[0] = first;
  for (let i = 0; i < strains.length; i++) u[i + 1] = u[i] + strains[i];
  return u;
}

/** Masses, inverse masses and place of the gap for two bodies along x. */
class Line {
  constructor(masses, first) {
    this.masses = Float64Array.from(masses);
    this.inverse = this.masses.map((m) => 1 / m);
    this.first = first;
    this.gap = first - 1;
    this.rigid = masses[0] === Infinity;
    this.chain = this.masses.subarray(first);
    this.target = this.masses.subarray(0, first);
    this.contactMass = 1 / (this.inverse[this.gap] + this.inverse[first]);
  }

  /**
   * Return the speed at which the bodies separate: velocity of the chain minus velocity of the
   * target.
   */
  separation(velocity) {
    const chain = meanOf(velocity, this.masses, this.first);
    return this.rigid ? chain : chain - meanOf(velocity, this.masses, 0, this.first);
  }
}

/**
 * Create a state: strains, velocities, space for forces, and the displacement of the first
 * particle.
 */
function makeState(particles) {
  const bonds = particles - 1;
  return {
    strain: new Float64Array(bonds),
    velocity: new Float64Array(particles),
    force: new Float64Array(bonds),
    position: 0,
  };
}

/** Copy a state, or its part that begins with particle `begin`. */
function copyState(from, to, begin = 0) {
  to.strain.set(from.strain.subarray(begin, begin + to.strain.length));
  to.velocity.set(from.velocity.subarray(begin, begin + to.velocity.length));
  to.position = from.position;
}

function drift(state, time) {
  const { strain, velocity } = state;
  state.position += time * velocity[0];
  for (let i = 0; i < strain.length; i++) strain[i] += time * (velocity[i + 1] - velocity[i]);
}

function kick({ strain, velocity, force }, bond, inverse, gap, time) {
  bond.forces(strain, force);
  force[gap] = 0;
  const last = strain.length;
  velocity[0] -= time * inverse[0] * force[0];
  for (let i = 1; i < last; i++) velocity[i] += time * inverse[i] * (force[i - 1] - force[i]);
  velocity[last] += time * inverse[last] * force[last - 1];
}

/** Take one composed step in place, without contacts. */
function leap(state, bond, inverse, gap, step) {
  drift(state, DRIFTS[0] * step);
  for (let k = 0; k < KICKS.length; k++) {
    kick(state, bond, inverse, gap, KICKS[k] * step);
    drift(state, DRIFTS[k + 1] * step);
  }
}

/**
 * Bound the number of contacts between two times by the sign changes among Bernstein coefficients
 * of the gap.
 */
function signChanges([x0, v0, a0], [x1, v1, a1], step) {
  const coefficients = [
    x0,
    x0 + step * v0 / 5,
    x0 + step * (0.4 * v0 + step * a0 / 20),
    x1 - step * (0.4 * v1 - step * a1 / 20),
    x1 - step * v1 / 5,
    x1,
  ];
  let changes = 0, last = 0;
  for (const c of coefficients) {
    if (c * last < 0) changes++;
    if (c !== 0) last = c;
  }
  return changes;
}

/** Motion of both bodies. */
class Motion {
  constructor(line, bond, { strains, velocities }, step) {
    Object.assign(this, { line, bond, step });
    const particles = line.masses.length;
    this.now = makeState(particles);
    this.now.strain.set(strains);
    this.now.velocity.set(velocities);
    // Displacements are relative to the natural position of the target's particle at the contact.
    for (let i = 0; i < line.gap; i++) this.now.position -= strains[i];
    this.kept = makeState(particles);
    this.last = makeState(particles);
    this.begin = Math.max(0, line.gap - NEAR);
    this.near = makeState(Math.min(particles, line.first + NEAR + 1) - this.begin);
    this.nearInverse = line.inverse.subarray(this.begin, this.begin + this.near.velocity.length);
    this.steps = 0;
    this.contacts = []; // times, closing speeds
    this.meet(0);
  }

  get time() {
    return this.steps * this.step;
  }

  /** If the particles at the gap touch and approach at speed w, exchange the momentum 2 mu w. */
  meet(time) {
    const { strain, velocity } = this.now, { gap, first, inverse, contactMass } = this.line;
    const closing = velocity[gap] - velocity[first];
    if (strain[gap] !== 0 || closing <= 0) return;
    velocity[gap] -= 2 * contactMass * closing * inverse[gap];
    velocity[first] += 2 * contactMass * closing * inverse[first];
    this.contacts.push([time, closing]);
    copyState(this.now, this.last);
  }

  /** Return the gap and its first two derivatives in time. */
  opening({ strain, velocity, force }, gap, inverse) {
    this.bond.forces(strain, force);
    const ahead = gap + 1 < strain.length ? force[gap + 1] : 0;
    const behind = gap > 0 ? force[gap - 1] : 0;
    return [
      strain[gap],
      velocity[gap + 1] - velocity[gap],
      -inverse[gap + 1] * ahead - inverse[gap] * behind,
    ];
  }

  /**
   * Return the gap and its derivatives at a time after the kept state, from the particles near the
   * gap.
   */
  probe(time) {
    const gap = this.line.gap - this.begin;
    copyState(this.kept, this.near, this.begin);
    leap(this.near, this.bond, this.nearInverse, gap, time);
    return this.opening(this.near, gap, this.nearInverse);
  }

  /** Return the time of the first contact within a step after the kept state; -1 for none. */
  findContact(step, start, end) {
    let low = 0, width = step, before = start;
    while (low < step) {
      const high = Math.min(low + width, step);
      width = high - low;
      const after = high < step ? this.probe(high) : end;
      const changes = signChanges(before, after, width);
      if (changes > 1 && width > NARROWEST * step) {
        width *= 0.5;
        continue;
      }
      if (changes === 1 || (after[0] <= 0 && after[1] < 0)) return this.refine(low, high);
      [low, width, before] = [high, 2 * width, after];
    }
    return -1;
  }

  /**
   * Find the contact by Newton's method between bounds: the gap is open at `low`, and not at
   * `high`.
   */
  refine(low, high) {
    let time = 0.5 * (low + high);
    for (let k = 0; k < 80; k++) {
      const [x, v] = this.probe(time);
      if (x === 0) return time;
      if (x > 0) low = time;
      else high = time;
      let better = v < 0 ? time - x / v : -1;
      if (!(better >= low && better <= high)) better = 0.5 * (low + high);
      const moved = Math.abs(better - time);
      time = better;
      if (moved <= 1e-15 * time || moved === 0) break;
    }
    return time;
  }

  /** Take one step with all contacts in it. */
  advance() {
    const { line, bond, now } = this;
    let left = this.step, found = 0;
    while (left > 0) {
      copyState(now, this.kept);
      const start = this.opening(now, line.gap, line.inverse);
      leap(now, bond, line.inverse, line.gap, left);
      const end = this.opening(now, line.gap, line.inverse);
      const time = this.findContact(left, start, end);
      if (time < 0) break;
      if (++found > MOST_CONTACTS_IN_A_STEP) throw new RangeError("contacts");
      copyState(this.kept, now);
      leap(now, bond, line.inverse, line.gap, time);
      left -= time;
      now.strain[line.gap] = 0;
      this.meet(this.time + this.step - left);
    }
    this.steps++;
    this.checkStrains();
  }

  /** Throw RangeError if a bond has a length below 0 or beyond its barrier, or is not a number. */
  checkStrains() {
    const { strain } = this.now, { gap } = this.line, least = -1, most = this.bond.barrier;
    for (let i = 0; i < strain.length; i++) {
      if (i === gap || (strain[i] > least && strain[i] < most)) continue;
      throw new RangeError(strain[i] >= most ? "barrier" : "crossing");
    }
  }

  /** Return the displacements of all particles along x. */
  displacements() {
    return displacementsOf(this.now.strain, this.now.position);
  }
}
