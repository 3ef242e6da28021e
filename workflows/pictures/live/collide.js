// Compute the restitution of a scene with an error bar: halve the time step until two runs agree.

// Target error of eta, met by USUAL_STEP in units of 1/frequency of the fastest bond.
const USUAL_GOAL = 1e-9;
const USUAL_STEP = 0.25;
const MOST_HALVINGS = 6;
const ORDER_TRUSTED = 64; // halving the step reduces errors 256 times; the error bar assumes less
const MOST_EVALUATIONS = 2e9; // evaluations of bond forces in a run, about half a minute
const SHORTEST = 1e-4; // if bonds may become shorter, 1 + s loses too many digits
// A run without a known end stops after this many times the duration of the contacts.
const PATIENCE = 6;
const CURVE = { goal: 1e-6, most: 1e8, patience: 2, film: false };
const FUTILE = 4; // a halving stalls if it changes eta by more than 1/FUTILE of the previous change
// If eta differs by less between two runs, the end of the first run holds for the second.
const STEADY = 1e-3;
const MARGIN = 5; // contact times differ by less than this between runs
const QUIET = 2.2; // time in which sound crosses a body and returns, plus a tenth
const TELL_EVERY = 250; // milliseconds

/** Return the masses of a body, repeating a list of masses. */
const repeated = (masses, count) => Array.from({ length: count }, (_, i) => masses[i % masses.length]);

/** Return the line, bond, speed and initial state of a scene. */
function prepare(scene) {
  const bond = bondOf(scene), unit = naturalSpeed(bond);
  const speed = scene.velocity ?? (scene.speed ?? 0.4) * (unit ?? NaN);
  if (!(speed > 0)) throw new Refusal("Speed must be more than 0.");
  const chain = repeated(scene.masses?.length ? scene.masses : [1], scene.particles);
  const free = scene.target_particles > 0;
  const target = free
    ? repeated(scene.target_masses?.length ? scene.target_masses : [1], scene.target_particles)
    : [Infinity];
  const line = new Line([...target.reverse(), ...chain], target.length);
  let state = scene.state;
  if (!state && scene.temperature > 0) {
    if (speed < 1e-4 * Math.sqrt(scene.temperature))
      throw new Refusal("Too slow for this temperature: it would hardly ever arrive.");
    state = drawState(line, bond, scene.temperature, scene.seed ?? 1, speed);
  }
  state ??= {
    strains: new Float64Array(line.masses.length - 1),
    velocities: Float64Array.from(line.masses, (_, i) => (i < line.first ? 0 : -speed)),
  };
  return { scene, bond, unit, line, state, speed };
}

const TOO_SHORT = "Bonds get too short for steps of one size: the program has a method for these, " +
  "see the command below. Choose a lower speed.";
const TOO_LONG = "This collision takes too long for a page: it is stiff, hot or slow. " +
  "Let the program itself carry it out, with the command below.";

/**
 * Return a time step that resolves the fastest bond, even if two particles approach each other at
 * twice the largest speed.
 */
function firstStep({ line, bond, state }, goal) {
  let fastest = 0, energy = 0, shortest = 0, lightest = Math.min(...line.chain);
  for (const v of state.velocities) fastest = Math.max(fastest, Math.abs(v));
  for (let i = 0; i + 1 < line.masses.length; i++) {
    if (i === line.gap) continue;
    const [a, b] = [line.masses[i], line.masses[i + 1]];
    energy = Math.max(energy, 2 * a * b / (a + b) * fastest ** 2);
    shortest = Math.min(shortest, state.strains[i]);
    lightest = Math.min(lightest, a, b);
  }
  shortest = Math.min(shortest, strainAt(bond, energy, -1));
  if (bond.floor === -1 && shortest < SHORTEST - 1) throw new Refusal(TOO_SHORT);
  const step = USUAL_STEP * (goal / USUAL_GOAL) ** (1 / 8);
  return step * Math.sqrt(lightest / Math.max(1, bond.curvature(shortest)));
}

/**
 * Run a collision with one time step. `known` is a run with another step; its end also holds for
 * this run if `steady` is true.
 */
function follow(setup, step, { film, most, patience, known, steady, tell = () => {} }) {
  const { line, bond, state, speed } = setup;
  const motion = new Motion(line, bond, state, step);
  const until = known ? known.end : Infinity;
  const stride = known ? Math.max(1, Math.round((until - known.begin) / FRAMES / step)) : 1;
  const reel = film && new Film(setup, stride, until);
  const sizes = [line.chain.length, line.rigid ? 1 : line.target.length], span = Math.max(...sizes);
  const heaviness = sumOf(line.chain) / line.chain.length;
  const slow = Math.sqrt(line.rigid || line.first === 1 ? heaviness
    : Math.max(heaviness, sumOf(line.target) / line.first));
  const mostSteps = most / (KICKS.length * line.masses.length);
  // At least, sound has to cross the longer body.
  if (span * slow > 2 * mostSteps * step) throw new Refusal(TOO_LONG);
  let look = 0, calmSince = 0, counted = 0, ending = null, told = Date.now();
  // Extreme strains of the bonds since the first contact: `lengths` up to this step, `within` up to
  // the step before the last contact.
  let lengths = [0, 0], within = [0, 0], met = 0;
  reel && reel.note(motion);
  while (!ending) {
    motion.advance();
    reel && reel.note(motion);
    const now = motion.time, contacts = motion.contacts;
    if (contacts.length !== met) [within, met] = [[...lengths], contacts.length];
    for (let i = 0; contacts.length && i < motion.now.strain.length; i++) {
      if (i === line.gap) continue;
      lengths[0] = Math.min(lengths[0], motion.now.strain[i]);
      lengths[1] = Math.max(lengths[1], motion.now.strain[i]);
    }
    if (motion.steps % 64 === 0 && Date.now() - told > TELL_EVERY) {
      told = Date.now();
      tell({ time: now, contacts: contacts.length, step });
    }
    if (motion.steps > mostSteps) throw new Refusal(TOO_LONG);
    if (now < look || !contacts.length) continue;
    const begin = contacts[0][0], last = contacts[contacts.length - 1][0];
    if (steady) {
      if (now > Math.max(until, known.begin + known.contacts.at(-1)[0] + MARGIN * slow))
        ending = known.ending;
      continue;
    }
    if (contacts.length !== counted) [counted, calmSince] = [contacts.length, last];
    look = Math.max(last + 1.4 * (now - last), now + Math.min(2, 0.2 * span) * slow);
    const risk = meetingRisk(motion);
    if (risk === 0) ending = "proved";
    if (risk > RISK_ALLOWED) calmSince = now;
    else if (!ending && now - calmSince > QUIET * span * slow) ending = "argued";
    const crossing = (span + 5) * slow;
    const followed = Math.min(patience * (last - begin) + 4 * crossing, 200 * crossing);
    if (!ending && now - begin > followed) ending = "open";
  }
  const begin = motion.contacts[0][0], { strain, velocity } = motion.last;
  const lastTime = motion.contacts[motion.contacts.length - 1][0] - begin;
  const end = begin + 1.15 * lastTime + Math.max(2, 0.25 * span) * slow;
  const broken = brokenBonds(bond, line.gap, line.masses, (i) => motion.now.strain[i],
    (i) => motion.now.velocity[i + 1] - motion.now.velocity[i], strain.length);
  const u = displacementsOf(strain);
  return {
    restitution: (line.separation(velocity) / speed) ** 2,
    separation: line.separation(velocity) / speed,
    contacts: motion.contacts.map(([time, closing]) => [time - begin, closing / speed]),
    ending,
    watched: steady ? known.watched : motion.time - begin - lastTime,
    fragments: steady ? known.fragments : 1 + sumOf(broken),
    begin,
    end,
    step,
    steps: motion.steps,
    shortest: within[0],
    longest: within[1],
    energies: partition(setup, u, velocity),
    final: { strain: Array.from(strain), velocity: Array.from(velocity) },
    displacements: u,
    film: reel ? reel.cut(begin, end) : null,
  };
}

/** Return the message for a run in which bonds left their allowed range. */
function refusalOf({ scene, bond }, reason) {
  if (reason === "barrier")
    return "A bond is stretched beyond its barrier, where U falls without bound: such a bond " +
      "has no motion to follow. Choose a lower speed.";
  if (bond.floor === -1) return TOO_SHORT;
  return `Particles would pass through each other: a ${scene.potential} bond does not keep them ` +
    "apart at this speed, and the order of the chain would be lost. Choose a lower speed.";
}

/**
 * Run a collision with an error bar, halving the step until two runs differ by at most `goal`.
 * `tell` receives the progress, and `show` each run that can be shown.
 */
function collide(scene, options = {}) {
  const { goal = USUAL_GOAL, most = MOST_EVALUATIONS, patience = PATIENCE, film = true } = options;
  const { tell, show = () => {} } = options;
  const setup = prepare(scene), { line, bond } = setup;
  const started = Date.now(), modes = film ? modesOf(line.chain) : null;
  // Number of halvings that hardly helped, and the last change of eta.
  let stalls = 0, last = Infinity;
  let step = firstStep(setup, goal), before = null, error = null, refused = null, steady = false;
  for (let halving = 0; halving <= MOST_HALVINGS; halving++, step /= 2) {
    let run;
    try {
      run = follow(setup, step, { film, most, patience, known: before, steady, tell });
    } catch (problem) {
      if (!(problem instanceof RangeError)) {
        // Keep the earlier result.
        if (error !== null && problem instanceof Refusal) break;
        throw problem;
      }
      refused = problem.message; // the step may be too long
      before = error = null;
      steady = false;
      if (halving >= 2 && bond.floor !== -1) break;
      continue;
    }
    refused = null;
    steady = true;
    if (before) {
      const change = Math.abs(run.restitution - before.restitution);
      // Rounding errors add up like a random walk, even if two runs agree by chance.
      const rounding = 2 ** -48 * Math.sqrt(run.steps);
      steady = change < STEADY;
      if (change > last / FUTILE) stalls++;
      last = change;
      error = Math.max(change, (error ?? 0) / ORDER_TRUSTED, rounding);
    }
    before = Object.assign(run, {
      error,
      seconds: (Date.now() - started) / 1000,
      speed: setup.speed,
      unit: setup.unit,
      masses: Array.from(line.masses),
      first: line.first,
      ...(film ? spectrumOf(setup, run, modes) : {}),
    });
    if (error !== null && error <= goal) break;
    // For a chaotic motion, shorter steps do not reduce the error.
    const tooMany = 2 * run.steps * KICKS.length * line.masses.length > most;
    if (error !== null && (stalls >= 2 || tooMany)) break;
    show(before, false);
  }
  if (!before) throw new Refusal(refusalOf(setup, refused));
  show(before, true);
  return before;
}

/**
 * Return the energies of the chain's modes after the last contact, divided by K_i, and the modes.
 */
function spectrumOf({ line, speed }, run, modes) {
  // If the chain broke, only the kinetic energies of modes have a meaning.
  const u = run.displacements.slice(line.first).map((x) => (run.fragments > 1 ? 0 : x));
  const v = run.final.velocity.slice(line.first), whole = sumOf(line.chain);
  const spectrum = modeEnergies(modes, line.chain, u, v).map((e) => e / (0.5 * whole * speed ** 2));
  return { spectrum, modes: { omega: modes.omega, shapes: Float32Array.from(modes.shapes) } };
}

/** Return the speeds of the curve, in an order that shows the shape of the curve early. */
function curveSpeeds(scene) {
  const linear = BONDS[scene.potential](scene).linear;
  if (linear && !(scene.temperature > 0)) return [0.1];
  const count = 40, largest = linear ? 0.5 : 2, order = [];
  for (let stride = 8, k; stride >= 1; stride /= 2)
    for (k = stride; k <= count; k += stride) if (!order.includes(k)) order.push(k);
  return order.map((k) => largest * k / count);
}

/**
 * Let a worker run one collision, or one for each speed of a curve, and post its results one by
 * one.
 */
function serve(scope) {
  scope.onmessage = ({ data: { id, task, scene } }) => {
    const post = (kind, content) => scope.postMessage({ id, kind, ...content });
    try {
      if (task === "collide") {
        const tell = (progress) => post("progress", { progress });
        collide(scene, { tell, show: (run, done) => post("run", { run, done }) });
        return;
      }
      const linear = BONDS[scene.potential](scene).linear;
      for (const speed of curveSpeeds(scene)) {
        const own = { ...scene, ...(linear ? { velocity: speed } : { speed, velocity: undefined }) };
        try {
          const run = collide(own, CURVE);
          post("point", { point: { speed, restitution: run.restitution, error: run.error,
                                   ending: run.ending, fragments: run.fragments } });
        } catch (problem) {
          if (!(problem instanceof Refusal)) throw problem;
          post("point", { point: { speed, refused: problem.message } });
        }
      }
      post("end", {});
    } catch (problem) {
      post("refused", { message: problem.message, expected: problem instanceof Refusal });
    }
  };
}
