// The page: its controls, its address, its workers, and the clock of the pictures.

const find = (id) => document.getElementById(id);
const embedded = window.self !== window.top;
const calm = matchMedia("(prefers-reduced-motion: reduce)");
const PLAYING_SECONDS = 10;
const state = { scene: null, time: 0, playing: false, chosen: false, id: 0, workers: {}, rate: 0 };

// The scene -------------------------------------------------------------------------------------

const PARAMETERS = { toda: ["toda_b"], morse: ["morse_a"], power: ["power_order", "power_c"] };
const TEXTS = ["potential", "toda_b", "morse_a", "power_order", "power_c", "speed", "velocity",
               "particles", "masses", "target_particles", "target_masses", "temperature", "seed"];

/** Positive numbers with commas between them. */
function readMasses(text, what) {
  const masses = text.split(",").filter((part) => part.trim()).map(Number);
  if (masses.some((m) => !(m >= 1e-3 && m <= 1e3)))
    throw new Refusal(`${what} are ${text}: expected numbers from 0.001 to 1000, such as 1,2.`);
  return masses;
}

/** One number of the form, refused by name where it is none. */
function readNumber(id, low, high, { whole = false } = {}) {
  const text = find(id).value, value = Number(text);
  if (text.trim() === "" || !(value >= low && value <= high) || (whole && value % 1))
    throw new Refusal(`${find(id).dataset.name} is ${text || "empty"}: expected ` +
      `${whole ? "a whole number" : "a number"} from ${low} to ${high}.`);
  return value;
}

/** The scene that the form says; Refusal where it says none. */
function readScene() {
  const scene = { potential: find("potential").value };
  if (scene.potential === "toda") scene.toda_b = readNumber("toda_b", 0.1, 100);
  if (scene.potential === "morse") scene.morse_a = readNumber("morse_a", 0.1, 100);
  if (scene.potential === "power") {
    scene.power_order = readNumber("power_order", 3, 20, { whole: true });
    const even = scene.power_order % 2 === 0;
    scene.power_c = readNumber("power_c", even ? 1e-3 : -1e3, even ? 1e3 : -1e-3);
  }
  scene.particles = readNumber("particles", 2, SETTINGS.mostParticles, { whole: true });
  const speed = readNumber("speed", 1e-4, 10);
  if (scene.potential === "harmonic") scene.velocity = speed;
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

/** Put what an address says into the form. */
function readAddress() {
  const given = new URLSearchParams(location.hash.slice(1));
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

/** A scene as the end of an address. */
function addressOf(scene) {
  const pairs = Object.entries(scene).map(([key, value]) => [key, String(value)]);
  return "#" + pairs.map(([key, value]) => `${key}=${value}`).join("&");
}

/** The command that has the program itself carry a scene out. */
function commandOf(scene) {
  const options = Object.entries(scene).map(
    ([key, value]) => `--${key.replaceAll("_", "-")} ${value}`
  );
  return ["chaincor run --engine reference", ...options].join(" ");
}

/** Show what belongs to the choices made. */
function arrange() {
  const bond = find("potential").value, linear = bond === "harmonic";
  for (const [name, keys] of Object.entries(PARAMETERS))
    for (const key of keys) find(key).parentElement.hidden = name !== bond;
  find("speed-unit").textContent = linear ? "\u221a(k/m) bond lengths" : "v*";
  find("speed-slider").max = linear ? 0.7 : 2.5;
  find("speed-slider").value = find("speed").value;
  find("particles-slider").value = find("particles").value;
  const masses = find("masses").value.replaceAll(" ", ""), count = Number(find("particles").value);
  find("pattern").value =
    Object.keys(PRESETS).find((name) => PRESETS[name](count) === masses) ?? "own";
  for (const row of document.querySelectorAll(".of-target"))
    row.hidden = find("target").value !== "free";
  find("seed").parentElement.hidden = !(Number(find("temperature").value) > 0);
}

// Computing -------------------------------------------------------------------------------------

/** A worker made of the page's own kernel: it needs no other file. */
function makeWorker() {
  const text = find("kernel").textContent + "\nserve(self);";
  const address = URL.createObjectURL(new Blob([text], { type: "text/javascript" }));
  const worker = new Worker(address);
  URL.revokeObjectURL(address);
  return worker;
}

/** Give a worker a task; what it did before is dropped. */
function start(task, scene) {
  let own = state.workers[task];
  if (own?.busy) {
    own.worker.terminate();
    own = null;
  }
  own ??= { worker: makeWorker() };
  own.busy = true;
  own.id = ++state.id;
  own.worker.onmessage = ({ data }) => data.id === own.id && hear(task, own, data);
  own.worker.onerror = (event) => {
    own.busy = false;
    refuse(`The computation failed: ${event.message}`);
  };
  own.worker.postMessage({ id: own.id, task, scene });
  state.workers[task] = own;
  busy();
}

/** Stop all computing. */
function stop() {
  for (const [task, own] of Object.entries(state.workers)) {
    if (!own.busy) continue;
    own.worker.terminate();
    delete state.workers[task];
  }
  find("progress").textContent = "Stopped.";
  busy();
}

function busy() {
  const working = Object.values(state.workers).some((own) => own.busy);
  find("stop").disabled = !working;
  document.body.dataset.state = working ? "working" : "idle";
}

/** What a worker says. */
function hear(task, own, data) {
  if (data.kind === "progress") {
    const { time, contacts } = data.progress;
    find("progress").textContent = `Computing: t = ${time.toFixed(0)}, ${contacts} hits so far \u2026`;
  } else if (data.kind === "run") {
    show(data.run, data.done);
    if (data.done) {
      own.busy = false;
      startCurve();
    }
  } else if (data.kind === "refused") {
    own.busy = false;
    refuse(data.expected ? data.message : `The computation failed: ${data.message}`);
    if (data.expected) startCurve();
  } else if (data.kind === "point") {
    shown.curve.push(data.point);
    find("curve-now").textContent = `${shown.curve.length} speeds so far \u2026`;
    curvePicture.forget();
    curvePicture.draw();
  } else {
    own.busy = false;
    find("curve-now").textContent = curveText();
    tabulate();
  }
  busy();
}

/** What the finished curve is. */
function curveText() {
  const refused = shown.curve.filter((p) => p.refused).length;
  const open = shown.curve.filter((p) => p.ending === "open").length;
  return [
    shown.flat ? "Springs behave alike at every speed." : `${shown.curve.length} speeds.`,
    open ? `Hollow: a later hit is not ruled out (${open}).` : "",
    refused ? `Crosses: refused (${refused}).` : "",
    shown.curve.some((p) => p.error > 0.002) ? "Bars: where the motion forgets its start." : "",
  ].filter(Boolean).join(" ");
}

/** Compute a curve, unless the one there is for the same scene at other speeds. */
function startCurve() {
  if (embedded) return null; // there it is not shown
  const { speed, velocity, ...others } = state.scene, key = JSON.stringify(others);
  if (key === state.curveKey) return curvePicture.draw();
  state.curveKey = key;
  shown.curve = [];
  shown.harmonic = others.potential === "harmonic";
  shown.flat = shown.harmonic && !(others.temperature > 0);
  curvePicture.forget();
  return start("curve", others);
}

/** The form has changed. */
function change({ later = 0 } = {}) {
  arrange();
  clearTimeout(state.waiting);
  state.waiting = setTimeout(() => {
    let scene;
    try {
      scene = readScene();
    } catch (problem) {
      refuse(problem.message);
      return;
    }
    const address = addressOf(scene);
    // At the first look the address stays as it was given.
    if (state.scene || location.hash) history.replaceState(null, "", address);
    state.scene = scene;
    find("command").textContent = commandOf(scene);
    find("progress").textContent = "Computing \u2026";
    state.fresh = true;
    start("collide", scene);
  }, later);
}

// What is shown ---------------------------------------------------------------------------------

const NOT_KNOWN = 0.01;

/** A number and its bar, to the digits that the bar leaves. */
function withBar(value, bar) {
  const digits = Math.min(12, Math.max(1, -Math.floor(Math.log10(bar))));
  const [mantissa, power] = (Math.ceil(bar * 10 ** digits) * 10 ** -digits)
    .toExponential(0).split("e");
  const text = value.toFixed(digits).replace(/(\.\d{3}|\d{3})(?=\d)/g, "$1\u2009");
  return `${text} \u00b1 ${mantissa}\u00b710${superscript(Number(power))}`;
}

const superscript = (k) => String(k).replace(/./g, (c) => "\u2070\u00b9\u00b2\u00b3\u2074\u2075\u2076\u2077\u2078\u2079"["0123456789".indexOf(c)] ?? "\u207b");

const ENDINGS = {
  proved: () => "That was the last hit: proved, the energy left cannot bring the chain back.",
  argued: () => "That was the last hit, as far as can be argued: to come back, energy would have to " +
    "gather as it hardly ever does.",
  open: (run) => `Not proved that it was the last hit: none came in the time ${run.watched.toFixed(0)} ` +
    "since, and the page looks no further. The bar does not hold what later hits may change.",
};

/** Show a run; its bar comes with the next one. */
function show(run, done) {
  const scene = state.scene, count = run.contacts.length, last = run.contacts[count - 1][0];
  shown.run = readyRun(run, scene);
  shown.energies = undefined;
  for (const picture of PICTURES) picture.forget();
  find("refusal").hidden = true;
  document.body.dataset.refused = "";
  const unknown = done && run.error > NOT_KNOWN;
  find("eta").textContent = unknown ? "not known"
    : run.error === null ? `${run.restitution.toFixed(4)} \u2026`
      : withBar(run.restitution, run.error);
  const share = `${(100 * run.restitution).toFixed(1)} %`, loose = run.fragments - 1;
  find("verdict").textContent = unknown
    ? `Runs with steps halved differ by ${run.error.toPrecision(1)}: this motion forgets its start, ` +
      "and the page gives no number. The pictures show one motion of many."
    : `${share} of the energy ${run.rigid === false || scene.target_particles ? "of relative motion " : ""}` +
      `comes back, after ${count} ${count === 1 ? "hit" : "hits"}, the last at t = ${last.toFixed(2)}. ` +
      (loose > 0 ? `The chain breaks at ${loose} ${loose === 1 ? "bond" : "bonds"}. ` : "");
  find("ending").textContent = ENDINGS[run.ending](run);
  find("ending").dataset.kind = run.ending;
  find("kinematic").textContent = unknown ? "" : `e = \u221a\u03b7 = ${Math.sqrt(run.restitution).toFixed(4)}`;
  find("progress").textContent = done
    ? `Steps of ${run.step.toPrecision(3)}, the same with twice that for the bar; ` +
      `${run.seconds.toFixed(2)} s.`
    : "Once more with half the step, for the error bar \u2026";
  const unit = run.unit === null ? "" : `; v* = ${run.unit.toPrecision(9)}`;
  find("facts").textContent = `v\u2080 = ${run.speed.toPrecision(6)}${unit}; shortest bond ` +
    `${(1 + run.shortest).toFixed(4)}, longest ${(1 + run.longest).toFixed(2)}.` +
    (scene.temperature ? ` Warm: T = ${scene.temperature}, seed ${scene.seed} of this page's own ` +
      "random numbers (sfc32), which are not the program's: the same seed there is another state."
      : "");
  find("break-key").hidden = !shown.run.broken.some((bonds) => bonds.some((b) => b));
  for (const part of document.querySelectorAll(".target-key"))
    part.hidden = !(scene.target_particles > 0);
  const { times } = run.film, slider = find("time");
  [slider.min, slider.max] = [times[0], times[times.length - 1]];
  slider.step = (slider.max - slider.min) / 1000;
  if (state.fresh) {
    state.fresh = false;
    seek(state.playing || calm.matches ? times[times.length - 1] : times[0]);
    if (!state.chosen && !calm.matches) play(true);
    else if (state.playing) seek(times[0]);
    else seek(times[times.length - 1]);
  } else seek(clamp(state.time, times[0], times[times.length - 1]));
}

/** Say why there is no number, and show none. */
function refuse(message) {
  find("refusal").textContent = message;
  find("refusal").hidden = false;
  document.body.dataset.refused = "yes";
  for (const id of ["progress", "eta", "verdict", "ending", "kinematic", "facts"])
    find(id).textContent = "";
  shown.run = null;
  play(false);
  for (const picture of PICTURES) {
    picture.forget();
    picture.draw({ time: 0, frame: 0 });
  }
}

/** The curve as a table. */
function tabulate() {
  const rows = shown.curve.slice().sort((a, b) => a.speed - b.speed).map((p) => {
    const cells = p.refused ? ["refused", ""] : [p.restitution.toFixed(5), p.ending];
    return `<tr><td>${shown.flat ? "any" : p.speed}</td><td>${cells.join("</td><td>")}</td></tr>`;
  });
  find("curve-table").innerHTML = "<table><thead><tr><th>speed</th><th>\u03b7</th><th>end</th></tr>" +
    `</thead><tbody>${rows.join("")}</tbody></table>`;
}

// The clock -------------------------------------------------------------------------------------

/** Show a moment. */
function seek(time) {
  const run = shown.run;
  if (!run) return;
  state.time = time;
  const { times } = run.film;
  let low = 0, high = times.length - 1;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (times[middle] <= time) low = middle;
    else high = middle;
  }
  const moment = { time, frame: time >= times[high] ? high : low };
  for (const picture of PICTURES) picture.draw(moment);
  const hits = run.contacts.filter(([t]) => t <= time).length;
  find("time").value = time;
  const text = `t = ${time.toFixed(1)}, ${hits} of ${run.contacts.length} hits`;
  find("time-text").textContent = text.replace("-", "\u2212");
  find("time").setAttribute("aria-valuetext", text);
}

/** Let time run, or stop it. */
function play(on) {
  state.playing = on;
  find("play").textContent = on ? "Pause" : "Play";
  find("play").setAttribute("aria-pressed", String(on));
  if (!on || !shown.run) return;
  const times = shown.run.film.times;
  if (state.time >= times[times.length - 1]) state.time = times[0];
  state.before = null;
  cancelAnimationFrame(state.frame);
  state.frame = requestAnimationFrame(advance);
}

function advance(now) {
  if (!state.playing || !shown.run) return;
  const times = shown.run.film.times, end = times[times.length - 1];
  const passed = state.before === null ? 0 : (now - state.before) / 1000;
  state.before = now;
  if (passed > 0) state.rate = 0.9 * state.rate + 0.1 / passed;
  const time = state.time + Math.min(passed, 0.2) * (end - times[0]) / PLAYING_SECONDS;
  seek(Math.min(time, end));
  if (time >= end) play(false);
  else state.frame = requestAnimationFrame(advance);
}

// Hands -----------------------------------------------------------------------------------------

const PRESETS = {
  equal: () => "1",
  alternating: () => "1,2",
  light: () => "1,0.5",
  first: (n) => [3, ...Array(Math.max(0, n - 1)).fill(1)].join(","),
  middle: (n) => Array.from({ length: n }, (_, i) => (i === n >> 1 ? 3 : 1)).join(","),
};

/** Wear a theme: light, dark, or null for that of the system. */
function wear(theme) {
  if (theme) document.documentElement.dataset.theme = theme;
  else delete document.documentElement.dataset.theme;
  const dark = theme ? theme === "dark" : matchMedia("(prefers-color-scheme: dark)").matches;
  find("theme").textContent = dark ? "Light" : "Dark";
  find("theme").setAttribute("aria-label", dark ? "Use light colours" : "Use dark colours");
  for (const picture of PICTURES) picture.forget();
  seek(state.time);
  curvePicture.draw();
}

function wire() {
  for (const [slider, box] of [["speed-slider", "speed"], ["particles-slider", "particles"]]) {
    find(slider).addEventListener("input", () => {
      find(box).value = find(slider).value;
      change({ later: 90 });
    });
    find(box).addEventListener("input", () => change({ later: 300 }));
  }
  find("potential").addEventListener("change", () => {
    // Springs count speeds in other units.
    find("speed").value = find("potential").value === "harmonic" ? 0.1 : 0.4;
    change();
  });
  find("power_order").addEventListener("change", () => {
    const odd = Number(find("power_order").value) % 2, c = Math.abs(Number(find("power_c").value));
    find("power_c").value = odd ? -c : c;
  });
  for (const id of ["toda_b", "morse_a", "power_order", "power_c", "masses", "target",
                    "target_particles", "target_masses", "temperature", "seed"])
    find(id).addEventListener("change", () => change());
  find("pattern").addEventListener("change", () => {
    find("masses").value = PRESETS[find("pattern").value](Number(find("particles").value));
    change();
  });
  find("again").addEventListener("click", () => {
    find("seed").value = Number(find("seed").value) + 1;
    change();
  });
  find("time").addEventListener("input", () => {
    state.chosen = true;
    play(false);
    seek(Number(find("time").value));
  });
  find("play").addEventListener("click", () => {
    state.chosen = true;
    play(!state.playing);
  });
  find("stop").addEventListener("click", stop);
  find("theme").addEventListener("click", () => {
    const theme = find("theme").textContent.toLowerCase();
    try {
      localStorage.setItem("theme", theme);
    } catch {
      // It is forgotten with the page.
    }
    wear(theme);
  });
  find("copy").addEventListener("click", async () => {
    const address = location.href.split("#")[0] + addressOf(state.scene);
    try {
      await navigator.clipboard.writeText(address);
      find("copied").textContent = "Copied.";
    } catch {
      find("copied").textContent = address;
    }
  });
  find("curve").addEventListener("click", (event) => {
    const axes = curvePicture, wide = axes.inner[0];
    const speed = axes.x0 + (axes.x1 - axes.x0) * (event.offsetX - axes.left) / wide;
    find("speed").value = clamp(speed, 0.01, axes.x1).toFixed(2);
    change();
  });
  document.addEventListener("keydown", (event) => {
    if (event.target.matches("input, select, button, summary, textarea") || !shown.run) return;
    const { times } = shown.run.film, first = times[0], last = times[times.length - 1];
    const step = (last - first) / (event.shiftKey ? 20 : 200);
    const moves = { ArrowRight: state.time + step, ArrowLeft: state.time - step, Home: first,
                    End: last };
    if (event.key === " ") play(!state.playing);
    else if (event.key in moves) {
      play(false);
      seek(clamp(moves[event.key], first, last));
    } else return;
    state.chosen = true;
    event.preventDefault();
  });
  window.addEventListener("hashchange", () => {
    readAddress();
    change();
  });
  new ResizeObserver(() => {
    for (const picture of PICTURES) picture.forget();
    seek(state.time);
    curvePicture.draw();
  }).observe(document.body);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () =>
    wear(document.documentElement.dataset.theme ?? null));
}

if (embedded) document.documentElement.classList.add("embedded");
let kept = null;
try {
  kept = localStorage.getItem("theme");
} catch {
  // Pages from files may have nothing to remember with.
}
find("particles").value = SETTINGS.particles;
readAddress();
wire();
wear(kept);
change();
