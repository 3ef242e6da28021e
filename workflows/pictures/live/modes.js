// Modes of a free body: E_j = (p_j^2 + omega_j^2 q_j^2)/2, as in analysis/modes.py.

/** Return the frequencies, and the shapes a_ij in rows, of a free chain of springs. */
function modesOf(masses) {
  const n = masses.length;
  if (masses.every((m) => m === masses[0])) {
    const shapes = new Float64Array(n * n), omega = new Float64Array(n);
    for (let j = 0; j < n; j++) {
      omega[j] = 2 * Math.sin(Math.PI * j / (2 * n)) / Math.sqrt(masses[0]);
      for (let i = 0; i < n; i++)
        shapes[j * n + i] =
          Math.sqrt((j ? 2 : 1) / n) * Math.cos(Math.PI * j * (i + 0.5) / n);
    }
    return { omega, shapes };
  }
  const diagonal = Float64Array.from(masses, (m, i) => (i % (n - 1) ? 2 : 1) / m);
  const beside = Float64Array.from(masses, (m, i) =>
    i + 1 < n ? -1 / Math.sqrt(m * masses[i + 1]) : 0);
  const vectors = new Float64Array(n * n);
  for (let i = 0; i < n; i++) vectors[i * n + i] = 1;
  solveTridiagonal(diagonal, beside, vectors);
  const order = Array.from(diagonal.keys()).sort((a, b) => diagonal[a] - diagonal[b]);
  const shapes = new Float64Array(n * n);
  order.forEach((from, to) =>
    shapes.set(vectors.subarray(from * n, (from + 1) * n), to * n));
  // The first mode is the translation, with frequency 0.
  const omega = Float64Array.from(order, (k, j) => (j ? Math.sqrt(Math.max(0, diagonal[k])) : 0));
  return { omega, shapes };
}

/** Implicit QL (Bowdler et al. 1968): eigenvalues into `d`, eigenvectors into the rows of `z`. */
function solveTridiagonal(d, e, z) {
  const n = d.length;
  for (let l = 0; l < n; l++) {
    for (;;) {
      let m = l;
      while (m + 1 < n && Math.abs(e[m]) > 2 ** -53 * (Math.abs(d[m]) + Math.abs(d[m + 1]))) m++;
      if (m === l) break;
      let g = (d[l + 1] - d[l]) / (2 * e[l]), r = Math.hypot(g, 1);
      g = d[m] - d[l] + e[l] / (g + (g >= 0 ? r : -r));
      let s = 1, c = 1, p = 0, i = m - 1;
      for (; i >= l; i--) {
        const f = s * e[i], b = c * e[i];
        e[i + 1] = r = Math.hypot(f, g);
        if (r === 0) {
          d[i + 1] -= p;
          e[m] = 0;
          break;
        }
        s = f / r;
        c = g / r;
        g = d[i + 1] - p;
        r = (d[i] - g) * s + 2 * c * b;
        p = s * r;
        d[i + 1] = g + p;
        g = c * r - b;
        for (let k = 0, a = i * n, o = a + n; k < n; k++, a++, o++) {
          const upper = z[o];
          z[o] = s * z[a] + c * upper;
          z[a] = c * z[a] - s * upper;
        }
      }
      if (r === 0 && i >= l) continue;
      d[l] -= p;
      e[l] = g;
      e[m] = 0;
    }
  }
}

/** Return the energies of all modes of a body, beginning with the translation. */
function modeEnergies({ omega, shapes }, masses, u, v, to = new Float64Array(masses.length)) {
  const n = masses.length, mean = meanOf(u, masses);
  for (let j = 0; j < n; j++) {
    let p = 0, q = 0;
    for (let i = 0, k = j * n; i < n; i++, k++) {
      const part = shapes[k] * Math.sqrt(masses[i]);
      p += part * v[i];
      q += part * (u[i] - mean);
    }
    to[j] = 0.5 * (p * p + omega[j] * omega[j] * q * q);
  }
  return to;
}
