// Connect controls, keys and themes, and start the page.

/** Draw all pictures again at the moment shown. */
function repaint() {
  for (const picture of PICTURES) picture.forget();
  seek(state.time);
  curvePicture.draw();
}

/** Apply a theme: light, dark, or null for the theme of the system. */
function wear(theme) {
  if (theme) document.documentElement.dataset.theme = theme;
  else delete document.documentElement.dataset.theme;
  const dark = theme ? theme === "dark" : matchMedia("(prefers-color-scheme: dark)").matches;
  find("theme").textContent = dark ? "Light" : "Dark";
  find("theme").setAttribute("aria-label", dark ? "Use light colours" : "Use dark colours");
  repaint();
}

/** If the numbers before it allow only the other sign of a bond parameter, change its sign. */
function turnSigns() {
  const scene = {};
  for (const [key, between] of Object.entries(BOND_FORM[find("potential").value].limits)) {
    const value = Number(find(key).value), [low, high] = between(scene);
    if (!(value >= low && value <= high) && -value >= low && -value <= high) find(key).value = -value;
    scene[key] = Number(find(key).value);
  }
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
    // For springs, speeds have other units.
    find("speed").value = BOND_FORM[find("potential").value].linear ? 0.1 : 0.4;
    change();
  });
  for (const key of BOND_NUMBERS) find(key).addEventListener("change", turnSigns);
  for (const id of [...BOND_NUMBERS, "masses", "target", "target_particles", "target_masses",
                    "temperature", "seed"])
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
  find("ask").addEventListener("click", () => {
    document.body.dataset.answer = "";
    repaint();
  });
  find("theme").addEventListener("click", () => {
    const theme = find("theme").textContent.toLowerCase();
    try {
      localStorage.setItem("theme", theme);
    } catch {
      // The theme is then lost when the page is closed.
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
  new ResizeObserver(repaint).observe(document.body);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () =>
    wear(document.documentElement.dataset.theme ?? null));
}

if (embedded) document.documentElement.classList.add("embedded");
let kept = null;
try {
  kept = localStorage.getItem("theme");
} catch {
  // Pages that were opened from files may have no storage.
}
find("particles").value = SETTINGS.particles;
readAddress();
wire();
wear(kept);
change();
