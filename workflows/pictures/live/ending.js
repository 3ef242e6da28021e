// Decide whether a collision is over. This is a simpler form of workflows/engines/ending.py and
// fragments.py that proves less: a body is cut into pieces where it breaks, and the first piece
// must lack the energy to come back.

// Part of the breaking energy that an end particle far from its piece has surely spent.
const PAID = 0.9;
const LEFT = 0.5; // part of the speed of separation that must remain after all pulls
const RESERVE = 1.5;
const VIBRATIONS = 100; // number of vibrations per particle that risks allow for
const RISK_ALLOWED = 1e-3; // the end counts as argued if the probability of a return is smaller
// Smallest share of a body in the distance and the speed between two bodies.
const LEAST_SHARE = 0.05;

/**
 * Return sums over the fractions w_i of the mass beyond each bond, for the first particle of a
 * piece.
 */
function leverOf(masses) {
  const whole = sumOf(masses);
  let beyond = 0, total = 0, squares = 0, largest = 0;
  for (let i = masses.length - 1; i > 0; i--) {
    beyond += masses[i];
    const share = beyond / whole;
    total += share;
    squares += share * share;
    largest = Math.max(largest, share);
  }
  return { particles: masses.length, total, squares, largest, mass: masses[0], whole,
           rest: whole - masses[0] };
}

/**
 * Return the largest strain of bonds with at most `energy`, and the smallest 2 U/s^2 of such bonds.
 */
function extentOf(bond, energy) {
  const low = strainAt(bond, energy, -1), high = strainAt(bond, energy, 1);
  let softest = 1;
  for (let k = 0; k <= 65; k++) {
    const s = low + (high - low) * k / 65;
    if (s !== 0) softest = Math.min(softest, 2 * bond.energy(s) / (s * s));
  }
  return [high, softest];
}

/**
 * Bound the distance of an end particle beyond the mean displacement of its piece, for an energy.
 */
function reachOf(bond, energy, lever) {
  if (lever.particles === 1 || energy <= 0) return 0;
  if (energy >= bond.breaking) return Infinity;
  const [longest, softest] = extentOf(bond, energy);
  let far = lever.total * longest;
  if (softest > 0) far = Math.min(far, Math.sqrt(2 * energy * lever.squares / softest));
  if (longest <= bond.convex) {
    const mean = energy * lever.largest / lever.total;
    far = Math.min(far, lever.total * strainAt(bond, mean, 1));
  }
  return far;
}

/**
 * Return the probability that a piece throws out its end particle with a speed, as molecules decay.
 */
function escapeRisk(bond, energy, lever, speed, patience) {
  if (lever.particles === 1) return 0;
  if (speed <= 0) return 1;
  const breaking = bond.breaking;
  const motion = 0.5 * speed * speed * lever.whole / lever.rest * lever.mass;
  const needed = breaking + (bond.barrier === Infinity ? motion : 0);
  if (energy < needed) return 0;
  const freedoms = lever.particles - 2;
  const decays = (1 - needed / energy) ** freedoms;
  const part = ((energy - needed) / (energy - breaking)) ** freedoms;
  return Math.min(1, Math.max(1e-300, Math.min(patience * decays, energy / breaking * part)));
}

/**
 * Cut a body at bonds. Return its pieces, which cuts surely move apart, and how firmly each binds.
 */
function cutAt(body, bond, cuts) {
  const { strains, velocities, masses, displacements, energies } = body;
  const pieces = [];
  for (let k = 0; k <= cuts.length; k++) {
    const begin = k ? cuts[k - 1] + 1 : 0, end = k < cuts.length ? cuts[k] + 1 : masses.length;
    const own = masses.subarray(begin, end), speed = meanOf(velocities, masses, begin, end);
    let energy = 0;
    for (let i = begin; i < end; i++) {
      energy += 0.5 * masses[i] * (velocities[i] - speed) ** 2;
      if (i + 1 < end) energy += energies[i];
    }
    pieces.push({ begin, end, mass: sumOf(own), speed, energy,
                  mean: meanOf(displacements, masses, begin, end),
                  front: leverOf(own), back: leverOf(own.slice().reverse()) });
  }
  const endOf = (energy, lever) => {
    if (energy < PAID * bond.depth || lever.particles === 1)
      return [reachOf(bond, energy, lever), 0];
    const free = 2 * (energy - PAID * bond.depth) * lever.rest / lever.whole / lever.mass;
    return [reachOf(bond, PAID * bond.depth, lever), Math.sqrt(free)];
  };
  // Lower bounds on the strain of the bond at each cut, and on the growth rate of this strain.
  const gapsOf = (energies, speeds) => cuts.map((cut, k) => {
    const [far, near] = [pieces[k], pieces[k + 1]];
    const [back, backSpeed] = endOf(energies[k], far.back);
    const [front, frontSpeed] = endOf(energies[k + 1], near.front);
    return [
      near.mean - Math.max(front, near.mean - displacements[cut + 1]) -
        far.mean - Math.max(back, displacements[cut] - far.mean),
      speeds[k][1] - speeds[k][0] - frontSpeed - backSpeed,
    ];
  });
  const pullAcross = (gap, growth) => (bond.depth - bond.energy(gap)) / growth;
  const worsened = (pulls) => pieces.map(({ energy, front, back }, k) => {
    const sides = (pulls[k - 1] ?? 0) / Math.sqrt(front.mass) +
      (pulls[k] ?? 0) / Math.sqrt(back.mass);
    return 0.5 * (Math.sqrt(2 * energy) + sides) ** 2;
  });
  const speeds = cuts.map((_, k) => [pieces[k].speed, pieces[k + 1].speed]);
  const first = gapsOf(pieces.map((piece) => piece.energy), speeds);
  const parting = first.map(([gap, growth]) => gap >= bond.convex && growth > 0);
  const pulls = first.map(([gap, growth], k) =>
    parting[k] ? RESERVE * pullAcross(gap, LEFT * growth) : 0);
  const slower = speeds.map(([v, w], k) =>
    [v + pulls[k] / pieces[k].mass, w - pulls[k] / pieces[k + 1].mass]);
  const apart = gapsOf(worsened(pulls), slower).map(([gap, growth], k) =>
    parting[k] && gap >= bond.convex && growth >= LEFT * first[k][1] &&
    pullAcross(gap, LEFT * first[k][1]) <= pulls[k]);
  const binding = cuts.map((cut, k) => {
    const [v, w] = speeds[k], [a, b] = [pieces[k].mass, pieces[k + 1].mass];
    const bound = 0.5 * a * b / (a + b) * (w - v) * Math.abs(w - v) + energies[cut] - bond.depth;
    return w > v ? bound : Math.min(bound, -Math.abs(w - v));
  });
  // If a cut is not proved to move apart, the pull follows from the present motion.
  worsened(cuts.map((cut, k) => {
    if (apart[k]) return pulls[k];
    const opening = speeds[k][1] - speeds[k][0];
    return opening > 0 ? pullAcross(strains[cut], LEFT * opening) : 0;
  })).forEach((energy, k) => (pieces[k].energy = energy));
  return { pieces, apart, binding };
}

/**
 * Cut a body into pieces that move apart. Return the first piece, and the probability that other
 * pieces disturb it.
 */
function firstPiece(body, bond) {
  let cuts = [];
  if (bond.depth < Infinity)
    body.strains.forEach((s, i) => s > bond.convex && cuts.push(i));
  for (;;) {
    const { pieces, apart, binding } = cutAt(body, bond, cuts);
    const failing = cuts.map((_, k) => k).filter((k) => !apart[k] && binding[k] <= 0);
    if (failing.length) {
      // The most firmly bound pieces are joined first, because the others may then move apart.
      failing.sort((a, b) => binding[a] - binding[b]);
      const bound = new Set(failing.slice(0, Math.max(1, Math.floor(failing.length / 3))));
      cuts = cuts.filter((_, k) => !bound.has(k));
      continue;
    }
    const patience = VIBRATIONS * body.masses.length;
    let disturbed = 0;
    apart.forEach((proved, k) => {
      if (proved) return;
      const [far, near] = [pieces[k], pieces[k + 1]], opening = near.speed - far.speed;
      disturbed += Math.max(
        escapeRisk(bond, far.energy, far.back, opening, patience),
        escapeRisk(bond, near.energy, near.front, opening, patience)
      );
    });
    return { ...pieces[0], disturbed: Math.min(1, disturbed), patience };
  }
}

/** Describe a body by particles from the contact outward, with velocities away from the contact. */
function bodyOf(bond, strains, velocities, masses) {
  const displacements = displacementsOf(strains), energies = strains.map(bond.energy);
  return { strains, velocities, masses, displacements, energies };
}

/**
 * Return the probability that a piece comes back to the plane: 0 if a return is ruled out, 1 while
 * the piece approaches.
 */
function returnRisk(piece, bond, displacement, speed) {
  const { front: lever, energy, disturbed, patience } = piece;
  if (speed <= 0) return 1;
  if (lever.particles === 1) return disturbed;
  const free = energy - 0.5 * speed * speed * lever.whole / lever.rest * lever.mass;
  if (displacement > 0 && reachOf(bond, free, lever) < displacement) return disturbed;
  const breaking = bond.breaking;
  if (free < breaking || displacement < reachOf(bond, PAID * breaking, lever)) return 1;
  return Math.min(1, disturbed + escapeRisk(bond, energy, lever, speed, patience));
}

/** Return the probability that the bodies meet again; 0 if this is ruled out. */
function meetingRisk({ line, bond, now }) {
  const { strain, velocity } = now, { first, gap, rigid } = line;
  if (line.separation(velocity) <= 0) return 1;
  const chain = firstPiece(
    bodyOf(bond, strain.slice(first), velocity.slice(first), line.chain), bond
  );
  // A wall or a single particle has no internal motion.
  let target = { speed: rigid ? 0 : -velocity[gap], mean: 0, energy: 0, mass: 1, size: 1 };
  if (!rigid && first > 1) {
    const mirrored = [strain.slice(0, gap), velocity.slice(0, first).map((v) => -v), line.target];
    target = firstPiece(bodyOf(bond, ...mirrored.map((part) => part.slice().reverse())), bond);
  }
  // A plane between the bodies gives the hotter body the larger share of the distance and the
  // speed.
  const single = target.front === undefined;
  const share = (a, b) => {
    const part = a + b > 0 ? a / (a + b) : 0.5;
    return single ? 1 : Math.min(Math.max(part, LEAST_SHARE), 1 - LEAST_SHARE);
  };
  const heat = ({ energy, mass }) => Math.sqrt(energy / mass);
  const width = ({ energy, end, begin }) => Math.sqrt(energy * (end - begin));
  const way = strain[gap] + chain.mean + target.mean, speed = chain.speed + target.speed;
  const near = single ? 1 : share(width(chain), width(target));
  const fast = single ? 1 : share(heat(chain), heat(target));
  const risk = returnRisk(chain, bond, near * way, fast * speed);
  if (single || risk === 1) return risk;
  return Math.min(1, risk + returnRisk(target, bond, (1 - near) * way, (1 - fast) * speed));
}

/** Mark the broken bonds: they are stretched and lengthen, and their energy exceeds the depth. */
function brokenBonds(bond, gap, masses, strainOf, openingOf, bonds) {
  const broken = new Uint8Array(bonds);
  if (bond.depth === Infinity) return broken;
  for (let i = 0; i < bonds; i++) {
    const opening = openingOf(i), s = strainOf(i);
    if (i === gap || !(s > 0 && opening > 0)) continue;
    const reduced = masses[i] * masses[i + 1] / (masses[i] + masses[i + 1]);
    broken[i] = 0.5 * reduced * opening * opening + bond.energy(s) > bond.depth ? 1 : 0;
  }
  return broken;
}
