// Texts about a run and about the curve.

const NOT_KNOWN = 0.01;

/** Return a value and its error bar as text, with the digits that the error bar allows. */
function withBar(value, bar) {
  const digits = Math.min(12, Math.max(1, -Math.floor(Math.log10(bar))));
  const [mantissa, power] = (Math.ceil(bar * 10 ** digits) * 10 ** -digits)
    .toExponential(0).split("e");
  const text = value.toFixed(digits).replace(/(\.\d{3}|\d{3})(?=\d)/g, "$1\u2009");
  return `${text} \u00b1 ${mantissa}\u00b710${superscript(Number(power))}`;
}

const superscript = (k) => String(k).replace(/./g, (c) => "\u2070\u00b9\u00b2\u00b3\u2074\u2075\u2076\u2077\u2078\u2079"["0123456789".indexOf(c)] ?? "\u207b");

const ENDINGS = {
  proved: () => "Proved that it was the last contact: the energy left cannot bring the chain back.",
  argued: () => "Very likely the last contact, but not proved: the energy left could bring the chain " +
    "back if nearly all of it met in one bond.",
  open: (run) => `Not proved that it was the last contact: in the time of ${run.watched.toFixed(0)} after it ` +
    "there was no other, and the page follows the chain no longer. A later one may still change \u03b7.",
};

/** Describe each picture of a run for readers who cannot see it. */
function describePictures(run, unknown) {
  const { contacts, spectrum } = run, { energies } = run.film;
  const speeds = contacts.map(([, speed]) => speed), after = energies[energies.length - 1];
  const percent = (part) => `${(100 * part).toFixed(unknown ? 0 : 1)} %`;
  const modes = Array.from(spectrum).slice(1), strongest = 1 + modes.indexOf(Math.max(...modes));
  const times = contacts.length === 1 ? "once" : `${contacts.length} times`;
  const words = {
    chain: `The particles at the moment shown; above each, its velocity.`,
    world: `Position of each particle against time. Particle 1 meets the wall or the target ${times}, ` +
      `the last time at ${contacts[contacts.length - 1][0].toFixed(1)}.`,
    energy: `At the end translation has ${percent(after[0])} of the energy that came, ` +
      `vibration ${percent(after[1] + after[2])}.`,
    contacts: `Speeds of approach from ${Math.min(...speeds).toFixed(2)} to ` +
      `${Math.max(...speeds).toFixed(2)} times the impact speed.`,
    spectrum: modes.length ? `After the last contact mode ${strongest} of ${modes.length} has most energy.`
      : "A single particle has no vibration.",
  };
  for (const [name, text] of Object.entries(words)) find(`${name}-words`).textContent = text;
}

/** Return a caption for the finished curve. */
function curveText() {
  const refused = shown.curve.filter((p) => p.refused).length;
  const open = shown.curve.filter((p) => p.ending === "open").length;
  return [
    shown.flat ? "With springs \u03b7 is the same at every speed." : `${shown.curve.length} speeds.`,
    open ? `Hollow points (${open}): a later contact may still change \u03b7 there.` : "",
    refused ? `Crosses (${refused}): speeds that the page refuses.` : "",
    shown.curve.some((p) => p.error > 0.002) ? "Bars: error bars of chaotic motions." : "",
  ].filter(Boolean).join(" ");
}

/** Show the curve as a table. */
function tabulate() {
  const rows = shown.curve.slice().sort((a, b) => a.speed - b.speed).map((p) => {
    const cells = p.refused ? ["refused", ""] : [p.restitution.toFixed(5), p.ending];
    return `<tr><td>${shown.flat ? "any" : p.speed}</td><td>${cells.join("</td><td>")}</td></tr>`;
  });
  find("curve-table").innerHTML = "<table><thead><tr><th>speed</th><th>\u03b7</th><th>end</th></tr>" +
    `</thead><tbody>${rows.join("")}</tbody></table>`;
}
