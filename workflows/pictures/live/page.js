// Run the page: its workers, and the clock of the pictures.

const embedded = window.self !== window.top;
const calm = matchMedia("(prefers-reduced-motion: reduce)");
const PLAYING_SECONDS = 10;
const state = { scene: null, time: 0, playing: false, chosen: false, id: 0, workers: {}, rate: 0 };

// Computing -------------------------------------------------------------------------------------

/** Create a worker from the kernel in the page, without another file. */
function makeWorker() {
  const text = find("kernel").textContent + "\nserve(self);";
  const address = URL.createObjectURL(new Blob([text], { type: "text/javascript" }));
  const worker = new Worker(address);
  URL.revokeObjectURL(address);
  return worker;
}

/** Give a worker a task, and drop its previous task. */
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

/** Handle a message from a worker. */
function hear(task, own, data) {
  if (data.kind === "progress") {
    const { time, contacts } = data.progress;
    find("progress").textContent = `Computing: t = ${time.toFixed(0)}, ${contacts} contacts so far \u2026`;
  } else if (data.kind === "run") {
    show(data.run, data.done);
    if (data.done) {
      own.busy = false;
      startCurve();
    }
  } else if (data.kind === "refused") {
    own.busy = false;
    refuse(data.expected ? data.message : `The computation failed: ${data.message}`, state.scene);
    if (data.expected) startCurve();
  } else if (data.kind === "point") {
    shown.curve.push(data.point);
    find("curve-now").textContent = `${shown.curve.length} speeds so far \u2026`;
    curvePicture.forget();
    curvePicture.draw();
  } else {
    own.busy = false;
    find("curve-now").textContent = curveText();
    find("curve-words").textContent = `${curveText()} All are in the table below.`;
    tabulate();
  }
  busy();
}

/** Compute a curve, unless the present curve belongs to the same scene at another speed. */
function startCurve() {
  if (embedded) return null; // an embedded page does not show the curve
  const { speed, velocity, ...others } = state.scene, key = JSON.stringify(others);
  if (key === state.curveKey) return curvePicture.draw();
  state.curveKey = key;
  shown.curve = [];
  shown.linear = BOND_FORM[others.potential].linear;
  shown.flat = shown.linear && !(others.temperature > 0);
  curvePicture.forget();
  return start("curve", others);
}

/** Handle a change of the form. */
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
    // When the page is opened, the address stays as given.
    if (state.scene || location.hash) history.replaceState(null, "", address);
    state.scene = scene;
    document.body.dataset.answer = state.question ? "asked" : "";
    sayCommand(scene);
    find("progress").textContent = "Computing \u2026";
    state.fresh = true;
    start("collide", scene);
  }, later);
}

/** Show the command with which chaincor computes a scene; empty without a scene. */
function sayCommand(scene) {
  const drawn = scene && firstStateOf(scene), link = find("first-state");
  find("command").textContent = scene ? commandOf(scene, drawn) : "";
  find("command-label").textContent = !scene ? "" : drawn
    ? "The same collision by the program chaincor, once the first state is saved as state.csv:"
    : scene.temperature
      ? "The program chaincor draws another first state from this seed, and so computes another collision:"
      : "The same collision by the program chaincor:";
  URL.revokeObjectURL(link.href);
  link.hidden = !drawn;
  link.href = drawn ? URL.createObjectURL(new Blob([drawn], { type: "text/csv" })) : "";
}

// What is shown ---------------------------------------------------------------------------------

/** Show a run; only the next run gives its error bar. */
function show(run, done) {
  const scene = state.scene, count = run.contacts.length, last = run.contacts[count - 1][0];
  shown.run = readyRun(run, scene);
  shown.energies = undefined;
  for (const picture of PICTURES) picture.forget();
  find("refusal").hidden = true;
  document.body.dataset.refused = "";
  const unknown = done && run.error > NOT_KNOWN;
  find("eta").textContent = unknown ? "not known"
    : run.error === null ? "\u2026"
      : run.ending === "open" ? `${run.restitution.toFixed(4)} so far`
      : withBar(run.restitution, run.error);
  const share = `${(100 * run.restitution).toFixed(run.error > 5e-4 ? 0 : 1)} %`, loose = run.fragments - 1;
  find("verdict").textContent = unknown
    ? `Halving the time step changes \u03b7 by ${run.error.toPrecision(1)}: this motion is chaotic, and ` +
      "the page gives no number. The pictures show one of many motions."
    : `${share} of the ${scene.target_particles ? "energy of relative motion" : "translational energy"} ` +
      `comes back, after ${count} ${count === 1 ? "contact" : "contacts"}, the last at t = ${last.toFixed(2)}. ` +
      (loose > 0 ? `The chain breaks at ${loose} ${loose === 1 ? "bond" : "bonds"}. ` : "");
  find("ending").textContent = ENDINGS[run.ending](run);
  find("ending").dataset.kind = run.ending;
  find("kinematic").textContent = unknown || run.error === null ? ""
    : `e = \u221a\u03b7 = ${Math.sqrt(run.restitution).toFixed(run.error > 5e-5 ? 2 : 4)}`;
  find("progress").textContent = done
    ? `Time step ${run.step.toPrecision(3)}; the run before, with ` +
      `${(2 * run.step).toPrecision(3)}, gives the error bar. Computed in ${run.seconds.toFixed(2)} s.`
    : "Another run, with half the time step, for the error bar \u2026";
  const unit = run.unit === null ? "" : `; v* = ${run.unit.toPrecision(9)}`;
  find("facts").textContent = `v\u2080 = ${run.speed.toPrecision(6)}${unit}.` +
    (run.masses.length > 2 ? ` Bond lengths, looked at after each time step up to the last contact: ` +
      `${(1 + run.shortest).toFixed(3)} to ${(1 + run.longest).toFixed(3)}.` : "") +
    (scene.temperature ? ` T = ${scene.temperature}; this page's own random numbers (sfc32) drew the ` +
      `first state from seed ${scene.seed}.` : "");
  describePictures(run, unknown);
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

/** Show why there is no result, and the command if chaincor can compute the scene. */
function refuse(message, scene = null) {
  find("refusal").textContent = message;
  find("refusal").hidden = false;
  document.body.dataset.refused = "yes";
  for (const id of ["progress", "eta", "verdict", "ending", "kinematic", "facts"])
    find(id).textContent = "";
  sayCommand(scene);
  shown.run = null;
  play(false);
  for (const picture of PICTURES) {
    picture.forget();
    picture.draw({ time: 0, frame: 0 });
  }
}

// The clock -------------------------------------------------------------------------------------

/** Show a moment. */
function seek(time) {
  const run = shown.run;
  if (!run) return;
  state.time = time;
  const { times } = run.film, end = times.length - 1;
  const frame = time >= times[end] ? end : panelOf(times, time);
  const moment = { time, frame };
  for (const picture of PICTURES) picture.draw(moment);
  const contacts = run.contacts.filter(([t]) => t <= time).length;
  find("time").value = time;
  const text = `t = ${time.toFixed(1)}, ${contacts} of ${run.contacts.length} contacts`;
  find("time-text").textContent = text.replace("-", "\u2212");
  find("time").setAttribute("aria-valuetext", text);
}

/** Start or stop the clock. */
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
