// Bond potentials U(r) as functions of the strain s = r - 1. Their formulas, `BONDS`, are generated
// from lammps_inputs/bonds/potentials.py. Units: natural bond length, particle mass, U''(1) = 1.

/** Return x - ln(1 + x) to full relative accuracy. */
function xMinusLog1p(x) {
  if (Math.abs(x) >= 0.1) return x - Math.log1p(x);
  const t = x / (2 + x), square = t * t;
  let sum = 0;
  for (let k = 11; k >= 0; k--) sum = sum * square + 1 / (2 * k + 3);
  return t * x - 2 * t * square * sum;
}

/** Return exp(x) - 1 - x to full relative accuracy. */
function expm1MinusX(x) {
  if (Math.abs(x) >= 0.1) return Math.expm1(x) - x;
  let sum = 0;
  for (let k = 14; k >= 3; k--) sum = (1 + sum) * x / k;
  return 0.5 * x * x * (1 + sum);
}

const square = (x) => x * x;


/** Return x^k; if k is a whole number, by multiplications. */
function power(x, k) {
  if (!(Number.isInteger(k) && k >= 0)) return x ** k;
  let product = 1;
  for (; k > 0; k >>= 1) {
    if (k & 1) product *= x;
    x *= x;
  }
  return product;
}

// Default limits of a bond: `floor` is the smallest strain, `depth` the energy that breaks the
// bond, `convex` the strain up to which U is convex, and `barrier` the strain beyond which U falls
// without bound.
const PLAIN = { floor: -Infinity, depth: Infinity, convex: Infinity, barrier: Infinity };

/** Return the bond of a scene. */
function bondOf(scene) {
  if (!Object.hasOwn(BONDS, scene.potential)) {
    throw new Error(`This page has no ${scene.potential} bond. Use chaincor run.`);
  }
  const bond = { ...PLAIN, ...BONDS[scene.potential](scene) };
  bond.breaking = Math.min(
    bond.depth, bond.barrier === Infinity ? Infinity : bond.energy(bond.barrier)
  );
  return bond;
}

/**
 * Return v* = sqrt(2 U(x*)), where x* is the strain at which U is twice its harmonic part, rounded
 * to 13 digits as in scenes; null for springs.
 */
function naturalSpeed(bond) {
  if (bond.linear) return null;
  const excess = (s) => bond.energy(s) / (s * s) - 1;
  let near = -1e-3, far = near;
  while (excess(near) >= 0) near *= 1e-3;
  for (far = near; !(excess(far) >= 0); ) {
    near = far;
    far = near * 1.1 > bond.floor ? near * 1.1 : 0.5 * (near + bond.floor);
  }
  const root = between((s) => excess(s) < 0, near, far);
  return Number(Math.sqrt(2 * bond.energy(root)).toExponential(12));
}

/**
 * Return, by bisection, the last number between `inside` and `outside` at which a condition holds.
 */
function between(holds, inside, outside) {
  for (;;) {
    const middle = 0.5 * (inside + outside);
    if (middle === inside || middle === outside) return inside;
    if (holds(middle)) inside = middle;
    else outside = middle;
  }
}

/**
 * Return the strain on one side (-1 compressed, 1 stretched) up to which the energy of a bond is at
 * most `energy`.
 */
function strainAt(bond, energy, side) {
  if (!(energy > 0)) return 0;
  const limit = side < 0 ? Math.abs(bond.floor) : bond.barrier;
  let far = Math.sqrt(2 * energy);
  while (far < limit && bond.energy(side * far) <= energy) far *= 2;
  return side * between((s) => bond.energy(side * s) <= energy, 0, Math.min(far, limit));
}
