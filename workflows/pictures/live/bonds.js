// Bonds U(r) as functions of the strain s = r - 1, without cancellation at small strains; the same
// formulas as in lammps_inputs/bonds. Units: bond length at rest, particle mass, U''(1) = 1.

/** x - ln(1 + x) to full relative accuracy. */
function xMinusLog1p(x) {
  if (Math.abs(x) >= 0.1) return x - Math.log1p(x);
  const t = x / (2 + x), square = t * t;
  let sum = 0;
  for (let k = 11; k >= 0; k--) sum = sum * square + 1 / (2 * k + 3);
  return t * x - 2 * t * square * sum;
}

/** exp(x) - 1 - x to full relative accuracy. */
function expm1MinusX(x) {
  if (Math.abs(x) >= 0.1) return Math.expm1(x) - x;
  let sum = 0;
  for (let k = 14; k >= 3; k--) sum = (1 + sum) * x / k;
  return 0.5 * x * x * (1 + sum);
}

/** x^k of a whole k, by multiplications. */
function wholePower(x, k) {
  let power = 1;
  for (; k > 0; k >>= 1) {
    if (k & 1) power *= x;
    x *= x;
  }
  return power;
}

// What a bond is unless it says otherwise: `floor` is the shortest strain, `depth` the energy that
// breaks it, `convex` the strain up to which U is convex, `barrier` that beyond which it runs away.
const PLAIN = { floor: -Infinity, depth: Infinity, convex: Infinity, barrier: Infinity, cubic: true };

const BONDS = {
  harmonic: () => ({
    cubic: false,
    linear: true,
    energy: (s) => 0.5 * s * s,
    curvature: () => 1,
    forces(strain, force) {
      for (let i = 0; i < strain.length; i++) force[i] = -strain[i];
    },
  }),

  lj: () => ({
    floor: -1,
    depth: 1 / 72,
    convex: (13 / 7) ** (1 / 6) - 1,
    energy: (s) => Math.expm1(-6 * Math.log1p(s)) ** 2 / 72,
    curvature: (s) => (13 * (1 + s) ** -14 - 7 * (1 + s) ** -8) / 6,
    forces(strain, force) {
      // (r^-13 - r^-7)/6 with the root at r = 1 divided out.
      for (let i = 0; i < strain.length; i++) {
        const s = strain[i], w = 1 / (1 + s), w2 = w * w, w4 = w2 * w2;
        force[i] = s * (1 + w) * (1 + w2 * (1 + w2)) * (w4 * w4 * (-1 / 6));
      }
    },
  }),

  toda: ({ toda_b: b = 10 }) => ({
    energy: (s) => expm1MinusX(-b * s) / (b * b),
    curvature: (s) => Math.exp(-b * s),
    forces(strain, force) {
      for (let i = 0; i < strain.length; i++) force[i] = Math.expm1(-b * strain[i]) / b;
    },
  }),

  morse: ({ morse_a: a = 6 }) => ({
    depth: 0.5 / (a * a),
    convex: Math.LN2 / a,
    energy: (s) => Math.expm1(-a * s) ** 2 * (0.5 / (a * a)),
    curvature: (s) => Math.exp(-a * s) * (2 * Math.exp(-a * s) - 1),
    forces(strain, force) {
      for (let i = 0; i < strain.length; i++) {
        const e = Math.expm1(Math.min(-a * strain[i], 350));
        force[i] = e * (1 + e) / a;
      }
    },
  }),

  log: () => ({
    floor: -1,
    energy: xMinusLog1p,
    curvature: (s) => (1 + s) ** -2,
    forces(strain, force) {
      for (let i = 0; i < strain.length; i++) force[i] = -strain[i] / (1 + strain[i]);
    },
  }),

  power: ({ power_order: order = 4, power_c: c = 1 }) => {
    const even = order % 2 === 0;
    return {
      cubic: false,
      convex: even ? Infinity : (-order * (order - 1) * c) ** (-1 / (order - 2)),
      barrier: even ? Infinity : (-order * c) ** (-1 / (order - 2)),
      energy: (s) => s * s * (0.5 + c * wholePower(s, order - 2)),
      curvature: (s) => 1 + order * (order - 1) * c * wholePower(s, order - 2),
      forces(strain, force) {
        for (let i = 0; i < strain.length; i++)
          force[i] = -strain[i] * (1 + order * c * wholePower(strain[i], order - 2));
      },
    };
  },
};

/** The bond of a scene. */
function bondOf(scene) {
  const bond = { ...PLAIN, ...BONDS[scene.potential](scene) };
  bond.breaking = Math.min(
    bond.depth, bond.barrier === Infinity ? Infinity : bond.energy(bond.barrier)
  );
  return bond;
}

/** v* = sqrt(2 U(x*)) where U is twice its harmonic part, to the 13 digits scenes know; or null. */
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

/** The last number, by halving, at which a condition that holds at `inside` still holds. */
function between(holds, inside, outside) {
  for (;;) {
    const middle = 0.5 * (inside + outside);
    if (middle === inside || middle === outside) return inside;
    if (holds(middle)) inside = middle;
    else outside = middle;
  }
}

/** The strain on one side (-1 short, 1 long) up to which a bond holds no more than an energy. */
function strainAt(bond, energy, side) {
  const limit = side < 0 ? Math.abs(bond.floor) : bond.barrier;
  let far = Math.sqrt(2 * energy);
  while (far < limit && bond.energy(side * far) <= energy) far *= 2;
  return side * between((s) => bond.energy(side * s) <= energy, 0, Math.min(far, limit));
}
