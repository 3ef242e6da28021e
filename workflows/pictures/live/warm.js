// Draw thermal states of warm bodies by inverting their distribution functions, as in
// lammps_inputs/bonds/equilibrium.py and thermal_state.py, but with other random numbers.

const PANELS = 2048;
const LEAST_DEPTH = 8; // the depth of a bond must be at least this many times T
const DENSITY_REACH = 50; // exp(-50) is below the resolution of the random numbers
const OVERLAP_RISK = 1e-12;
const SHARES = 256;

/**
 * Return a generator of uniform random numbers of 53 bits between 0 and 1, both excluded (sfc32).
 */
function uniformNumbers(seed, body) {
  let [a, b, c, d] = [seed >>> 0, Math.floor(seed / 2 ** 32) >>> 0, 0x9e3779b9 ^ body, 1];
  const next = () => {
    const sum = (a + b + d) | 0;
    d = (d + 1) | 0;
    a = b ^ (b >>> 9);
    b = (c + (c << 3)) | 0;
    c = ((c << 21) | (c >>> 11)) + sum | 0;
    return sum >>> 0;
  };
  for (let k = 0; k < 20; k++) next();
  return () => ((next() >>> 5) * 2 ** 26 + (next() >>> 6) + 0.5) * 2 ** -53;
}

/**
 * Return the index of the last element of a rising array that is not larger than a number, but
 * never the index of the very last element.
 */
function panelOf(rising, number) {
  let first = 0, last = rising.length - 1;
  while (last - first > 1) {
    const middle = (first + last) >> 1;
    if (rising[middle] <= number) first = middle;
    else last = middle;
  }
  return first;
}

/**
 * Tabulate the distribution with density exp(-exponent(x)) between two ends, by Simpson's rule on
 * panels.
 */
function distribution(exponent, low, high) {
  const width = (high - low) / PANELS, below = new Float64Array(PANELS + 1);
  const density = Float64Array.from({ length: 2 * PANELS + 1 }, (_, k) =>
    Math.exp(-exponent(low + 0.5 * k * width)));
  for (let k = 0; k < PANELS; k++)
    below[k + 1] = below[k] +
      width * (density[2 * k] + 4 * density[2 * k + 1] + density[2 * k + 2]) / 6;
  const whole = below[PANELS];

  /** Return the quantile x for a probability, from a cubic within the panel. */
  const inverse = (probability) => {
    const first = panelOf(below, probability * whole);
    const [p, q, r] = density.slice(2 * first, 2 * first + 3);
    const sought = (probability * whole - below[first]) / width;
    const inside = (t) =>
      t * (p + t * ((4 * q - 3 * p - r) / 2 + t * (2 * (p - 2 * q + r)) / 3));
    return low + width * (first + between((t) => inside(t) <= sought, 0, 1));
  };

  /** The function logMoment returns the logarithm of the mean of exp(slope (x - mean)). */
  const nodes = Array.from({ length: 257 }, (_, k) => k * PANELS / 128);
  const weights = nodes.map((k) => density[k]), mass = sumOf(weights);
  const places = nodes.map((k) => low + 0.5 * k * width);
  const mean = places.reduce((sum, x, k) => sum + x * weights[k], 0) / mass;
  const variance = places.reduce((sum, x, k) => sum + (x - mean) ** 2 * weights[k], 0) / mass;
  const logMoment = (slope) => {
    const largest = Math.max(slope * (low - mean), slope * (high - mean));
    let sum = 0;
    for (let k = 0; k < nodes.length; k++)
      sum += weights[k] * Math.exp(slope * (places[k] - mean) - largest);
    return Math.log(sum / mass) + largest;
  };
  return { inverse, mean, variance, logMoment };
}

/** Return the distribution of the strain of a bond at a temperature. */
function bondDistribution(bond, temperature) {
  const pressed = bond.linear ? Infinity : bond.energy(-1);
  const depth = Math.min(pressed, bond.breaking);
  if (!(LEAST_DEPTH * temperature <= depth))
    throw new Refusal(
      `Temperature ${temperature} is too high, since bonds would break: choose T of ` +
        `${(depth / LEAST_DEPTH).toPrecision(2)} or less for this bond.`
    );
  const level = DENSITY_REACH * temperature;
  const low = Math.max(strainAt(bond, level, -1), bond.linear ? -Infinity : -1);
  const high = strainAt(bond, Math.min(level, bond.depth - temperature, bond.breaking), 1);
  return distribution((s) => bond.energy(s) / temperature, low, high);
}

/**
 * Return the fraction of the mass beyond each bond. The strain of the bond moves the centre of mass
 * by this fraction.
 */
function sharesOf(masses) {
  const shares = new Float64Array(Math.max(0, masses.length - 1));
  let beyond = 0;
  for (let i = masses.length - 1; i > 0; i--) shares[i - 1] = beyond += masses[i];
  return shares.map((share) => share / (beyond + masses[0]));
}

/**
 * Return the initial distance between the bodies' centres of mass, beyond its mean in contact, from
 * Chernoff's bound.
 */
function startMargin(bonds, shares) {
  const counts = new Map();
  for (const share of shares) {
    const rounded = Math.ceil(share * SHARES) / SHARES;
    counts.set(rounded, (counts.get(rounded) ?? 0) + 1);
  }
  let squares = 0;
  for (const [share, count] of counts) squares += count * share * share;
  const width = Math.sqrt(bonds.variance * squares);
  let least = Infinity;
  for (let k = -4; k <= 12; k++) {
    const slope = 2 ** (k / 2) / width;
    let sum = -Math.log(OVERLAP_RISK);
    for (const [share, count] of counts) sum += count * bonds.logMoment(slope * share);
    least = Math.min(least, sum / slope);
  }
  return least;
}

/**
 * Draw the strains of a body, and the velocities relative to its centre of mass, from the contact
 * outward.
 */
function drawBody(bonds, normal, temperature, masses, seed, body) {
  const uniform = uniformNumbers(seed, body), count = masses.length;
  const velocities = new Float64Array(count), strains = new Float64Array(Math.max(0, count - 1));
  if (count < 2) return { strains, velocities };
  let momentum = 0, mass = 0;
  for (let i = 0; i < count; i++) {
    velocities[i] = Math.sqrt(temperature / masses[i]) * normal.inverse(uniform());
    if (i + 1 < count) strains[i] = bonds.inverse(uniform());
    momentum += masses[i] * velocities[i];
    mass += masses[i];
  }
  return { strains, velocities: velocities.map((v) => v - momentum / mass) };
}

/**
 * Draw strains and velocities along x of both bodies in equilibrium, with the chain approaching.
 */
function drawState(line, bond, temperature, seed, speed) {
  const bonds = bondDistribution(bond, temperature);
  const normal = distribution((x) => 0.5 * x * x, -9, 9);
  const target = line.rigid ? new Float64Array(0) : line.target.slice().reverse();
  const near = drawBody(bonds, normal, temperature, line.chain, seed, 0);
  const far = drawBody(bonds, normal, temperature, target, seed, 1);
  const shares = [sharesOf(line.chain), sharesOf(target)];
  const margin = startMargin(bonds, [...shares[0], ...shares[1]]);
  let distance = margin;
  near.strains.forEach((s, i) => (distance -= shares[0][i] * (s - bonds.mean)));
  far.strains.forEach((s, i) => (distance -= shares[1][i] * (s - bonds.mean)));
  while (distance <= 0) distance += margin;
  return {
    strains: [...far.strains.reverse(), distance, ...near.strains],
    velocities: [
      ...(line.rigid ? [0] : far.velocities.reverse()), ...near.velocities.map((v) => v - speed),
    ],
  };
}
