// Convert between the form, its scene, an address and a command.

const find = (id) => document.getElementById(id);

const PRESETS = {
  equal: () => "1",
  alternating: () => "1,2",
  light: () => "1,0.5",
  first: (n) => [3, ...Array(Math.max(0, n - 1)).fill(1)].join(","),
  middle: (n) => Array.from({ length: n }, (_, i) => (i === n >> 1 ? 3 : 1)).join(","),
};

const BOND_NUMBERS = Object.values(BOND_FORM).flatMap((form) => Object.keys(form.limits));
const TEXTS = ["potential", ...BOND_NUMBERS, "speed", "velocity", "particles",
               "masses", "target_particles", "target_masses", "temperature", "seed"];

/** Read positive numbers that are separated by commas. */
function readMasses(text, what) {
  const masses = text.split(/[\s,;]+/).filter((part) => part).map(Number);
  if (masses.some((m) => !(m >= 1e-3 && m <= 1e3)))
    throw new Refusal(`${what} are ${text}: expected numbers from 0.001 to 1000, such as 1,2.`);
  return masses;
}

/** Read one number of the form; throw a Refusal that names an invalid field. */
function readNumber(id, low, high, { whole = false } = {}) {
  const text = find(id).value, value = Number(text);
  if (text.trim() === "" || !(value >= low && value <= high) || (whole && value % 1))
    throw new Refusal(`${find(id).dataset.name} is ${text || "empty"}: expected ` +
      `${whole ? "a whole number" : "a number"} from ${low} to ${high}.`);
  return value;
}

/** Return the scene in the form; throw a Refusal if the form is invalid. */
function readScene() {
  const scene = { potential: find("potential").value };
  const { linear, whole, limits } = BOND_FORM[scene.potential];
  for (const [key, between] of Object.entries(limits))
    scene[key] = readNumber(key, ...between(scene), { whole: whole.includes(key) });
  scene.particles = readNumber("particles", 1, SETTINGS.mostParticles, { whole: true });
  const speed = readNumber("speed", 1e-4, 10);
  if (linear) scene.velocity = speed;
  else scene.speed = speed;
  const masses = readMasses(find("masses").value, "Masses");
  if (masses.some((m) => m !== 1)) scene.masses = masses;
  if (find("target").value === "free") {
    scene.target_particles =
      readNumber("target_particles", 1, SETTINGS.mostParticles, { whole: true });
    const others = readMasses(find("target_masses").value, "Masses of the target");
    if (others.some((m) => m !== 1)) scene.target_masses = others;
  }
  const temperature = readNumber("temperature", 0, 1);
  if (temperature > 0) {
    scene.temperature = temperature;
    scene.seed = readNumber("seed", 0, 2 ** 32 - 1, { whole: true });
  }
  return scene;
}

/** Fill the form from the address of the page. */
function readAddress() {
  const given = new URLSearchParams(location.hash.slice(1));
  state.question = given.get("eta") === "hidden";
  for (const key of TEXTS) {
    const value = given.get(key);
    if (value === null) continue;
    if (key === "velocity") find("speed").value = value;
    else find(key).value = value;
    if (key === "target_particles") find("target").value = Number(value) > 0 ? "free" : "wall";
    if (key === "temperature" || key === "masses" || key === "target_particles")
      find("more").open = true;
  }
}

/**
 * Return the end of the address for a scene. The address also says whether the restitution is
 * hidden until the reader asks.
 */
function addressOf(scene) {
  const pairs = Object.entries(scene).map(([key, value]) => [key, String(value)]);
  if (state.question) pairs.push(["eta", "hidden"]);
  return "#" + pairs.map(([key, value]) => `${key}=${value}`).join("&");
}

/**
 * Return the random initial state of a warm chain at a wall as a file for --initial; null for other
 * scenes.
 */
function firstStateOf(scene) {
  if (!(scene.temperature > 0) || scene.target_particles > 0) return null;
  try {
    const { line, state } = prepare(scene);
    const rows = Array.from(line.chain, (_, i) =>
      `${state.strains[line.gap + i]},${state.velocities[line.first + i]}`);
    return ["strain,velocity", ...rows, ""].join("\n");
  } catch (problem) {
    if (problem instanceof Refusal) return null; // the worker reports the reason
    throw problem;
  }
}

/**
 * Return the command with which chaincor runs the scene, from the drawn initial state if there is
 * one.
 */
function commandOf(scene, drawn) {
  const { speed, velocity, temperature, seed, ...rest } = scene;
  const options = Object.entries(drawn ? { ...rest, initial: "state.csv" } : scene).map(
    ([key, value]) => `--${key.replaceAll("_", "-")} ${value}`
  );
  return ["chaincor run --engine reference", ...options].join(" ");
}

/** Show the fields that belong to the present choices. */
function arrange() {
  const { linear, limits } = BOND_FORM[find("potential").value];
  const scene = {};
  for (const key of BOND_NUMBERS) {
    find(key).parentElement.hidden = !(key in limits);
    if (!(key in limits)) continue;
    find(`${key}-hint`).textContent = limits[key](scene).join(" to ").replaceAll("-", "\u2212");
    scene[key] = Number(find(key).value);
  }
  find("speed-unit").textContent = linear ? "bond lengths \u00d7 \u221a(k/m)" : "v*";
  find("speed-hint").textContent = linear
    ? `0.0001 to 10${state.question ? "" : "; with springs \u03b7 is the same at every speed"}`
    : "0.0001 to 10; at v* a bond is compressed so far that it no longer acts as a spring";
  find("speed-slider").max = linear ? 0.7 : 2.5;
  find("speed-slider").value = find("speed").value;
  find("particles-slider").value = find("particles").value;
  const masses = find("masses").value.trim().split(/[\s,;]+/).join(","), count = Number(find("particles").value);
  find("pattern").value =
    Object.keys(PRESETS).find((name) => PRESETS[name](count) === masses) ?? "own";
  for (const row of document.querySelectorAll(".of-target"))
    row.hidden = find("target").value !== "free";
  find("seed").closest(".field").hidden = !(Number(find("temperature").value) > 0);
}
