// Measures blur: how much wider the blur of one picture is than that of another, sharper one of the same place. Knows nothing
// of lenses, distances or the page.
"use strict";

/**
 * A round aperture spreads each point over a disk of diameter d, which takes from a frequency k (cycles a pixel) the part
 * J(d k), J(x) = 2 J1(pi x)/(pi x). The same lens with a smaller aperture spreads it over a disk of d r. So the spectra of the
 * two pictures, P and R, have the ratio J(d k)/J(d r k) whatever the scene is, and the d for which that fits best is
 * the blur. Cross and power spectra of overlapping patches are summed over rings of |k|, each weighed by what it has beside
 * what R explains. R is taken twice: the noise of one has nothing to do with that of the other, and falls out.
 */
const blurOf = (() => {
  /** Of the series, good for x up to about 20. */
  function j1(x) {
    let term = x / 2, sum = term;
    for (let m = 1; m < 60; ++m) {
      term *= -(x * x / 4) / (m * (m + 1));
      sum += term;
      if (Math.abs(term) < 1e-12) break;
    }
    return sum;
  }
  const jinc = (x) => Math.abs(x) < 1e-6 ? 1 : 2 * j1(Math.PI * x) / (Math.PI * x);

  /** cos and sin of 2 pi i / n. */
  function waves(n) {
    const all = { cos: new Float64Array(n), sin: new Float64Array(n) };
    for (let i = 0; i < n; ++i) {
      all.cos[i] = Math.cos(2 * Math.PI * i / n);
      all.sin[i] = Math.sin(2 * Math.PI * i / n);
    }
    return all;
  }

  const reach = (n) => Math.ceil(0.36 * n);  // beyond that noise is most of a picture

  /** The spectrum of real n x n samples for |u|, |v| up to reach(n), u >= 0, as [real, imaginary] of n rows each. */
  function spectrum(samples, n, wave) {
    const half = reach(n) + 1, across = [new Float64Array(n * half), new Float64Array(n * half)];
    const whole = [new Float64Array(n * half), new Float64Array(n * half)];
    for (let y = 0; y < n; ++y) {
      for (let u = 0; u < half; ++u) {
        let [re, im] = [0, 0];
        for (let x = 0; x < n; ++x) {
          const at = u * x % n, value = samples[y * n + x];
          re += value * wave.cos[at];
          im -= value * wave.sin[at];
        }
        across[0][y * half + u] = re;
        across[1][y * half + u] = im;
      }
    }
    for (let u = 0; u < half; ++u) {
      for (let v = 0; v < n; ++v) {
        if (Math.min(v, n - v) >= half) continue;
        let [re, im] = [0, 0];
        for (let y = 0; y < n; ++y) {
          const at = v * y % n, a = across[0][y * half + u], b = across[1][y * half + u];
          re += a * wave.cos[at] + b * wave.sin[at];
          im += b * wave.cos[at] - a * wave.sin[at];
        }
        whole[0][v * half + u] = re;
        whole[1][v * half + u] = im;
      }
    }
    return whole;
  }

  /** A patch under a window that falls to nothing at its edges, without its mean. */
  function patchOf(picture, left, top, n, window) {
    const patch = new Float64Array(n * n);
    let [sum, weights] = [0, 0];
    for (let y = 0; y < n; ++y) {
      for (let x = 0; x < n; ++x) {
        const weight = window[x] * window[y], value = picture.light[(top + y) * picture.width + left + x];
        patch[y * n + x] = value;
        sum += value * weight;
        weights += weight;
      }
    }
    const mean = sum / weights;
    for (let y = 0; y < n; ++y) for (let x = 0; x < n; ++x) patch[y * n + x] = (patch[y * n + x] - mean) * window[x] * window[y];
    return patch;
  }

  function placesOf(length, n) {
    const steps = Math.max(1, Math.min(3, Math.ceil((length - n) / (n / 2)) + (length > n ? 1 : 0)));
    return Array.from({ length: steps }, (_, i) => steps === 1 ? Math.floor((length - n) / 2) : Math.round(i * (length - n) / (steps - 1)));
  }

  /** By rings of |k|: cross spectrum a, power of R b and of P c, how many samples. */
  function rings(blurred, sharps) {
    const side = Math.min(blurred.width, blurred.height, 128), n = side - side % 2, wave = waves(n);
    const window = Float64Array.from({ length: n }, (_, i) => Math.sin(Math.PI * (i + 0.5) / n) ** 2);
    const all = Array.from({ length: n / 2 + 1 }, (_, i) => ({ k: 0, a: 0, b: 0, c: 0, count: 0 }));
    for (const top of placesOf(blurred.height, n)) {
      for (const left of placesOf(blurred.width, n)) {
        const [[pr, pi], [rr, ri], [sr, si]] = [blurred, ...sharps].map((one) => spectrum(patchOf(one, left, top, n, window), n, wave));
        for (let v = 0; v < n; ++v) {
          for (let u = 0; u <= reach(n); ++u) {
            const k = Math.hypot(u, Math.min(v, n - v)), ring = all[Math.round(k)], at = v * (reach(n) + 1) + u;
            if (k > reach(n)) continue;
            ring.a += 0.5 * (pr[at] * (rr[at] + sr[at]) + pi[at] * (ri[at] + si[at]));
            const power = rr[at] * sr[at] + ri[at] * si[at];
            ring.k += power * k / n;
            ring.b += power;
            ring.c += pr[at] ** 2 + pi[at] ** 2;
            ring.count += 1;
          }
        }
      }
    }
    return all.filter((ring) => ring.b > 0).map((ring) => ({ ...ring, k: ring.k / ring.b }));
  }

  /** What is left unexplained of each ring, a sample, with blur d; and the gain between the two pictures that fits best. */
  function misfit(used, d, ratio, weights) {
    let [cross, power] = [0, 0];
    const parts = used.map((ring) => jinc(d * ring.k) / jinc(d * ratio * ring.k));
    used.forEach((ring, i) => {
      cross += weights[i] * ring.a * parts[i];
      power += weights[i] * ring.b * parts[i] ** 2;
    });
    const gain = cross / power;
    let left = 0;
    used.forEach((ring, i) => { left += weights[i] * (ring.c - 2 * gain * parts[i] * ring.a + (gain * parts[i]) ** 2 * ring.b); });
    return left;
  }

  /** The best d up to `most`, with the half width in which the misfit grows by what chance does to it. */
  function fit(used, ratio, most) {
    const weights = used.map((ring) => 1 / (Math.max(0, ring.c - ring.a ** 2 / ring.b) / ring.count + 1e-3 * ring.c / ring.count));
    const samples = used.reduce((sum, ring) => sum + ring.count, 0) / 4;  // patches overlap, windows join neighbours
    const step = most / 400, tried = Array.from({ length: 401 }, (_, i) => misfit(used, i * step, ratio, weights));
    const least = Math.min(...tried), best = tried.indexOf(least), grown = least * (1 + 1 / samples);
    let [low, high] = [best, best];
    while (low > 0 && tried[low] < grown) --low;
    while (high < 400 && tried[high] < grown) ++high;
    return { px: best * step, sigmaPx: Math.max(step, (high - low) * step / 2) };
  }

  /**
   * `blurred` and both `sharps`: {width, height, light: samples proportional to light} of the same place; `ratio`: blur of
   * the sharp ones over that of the other, below 1. Gives {px, sigmaPx}, or null where there is too little to be seen.
   */
  return function blurOf(blurred, sharps, ratio) {
    if (Math.min(blurred.width, blurred.height) < 24 || !(ratio < 0.8)) return null;
    const all = rings(blurred, sharps);
    // From coarse to fine: the frequencies of each step end about where the blur found so far leaves nothing.
    let found = null;
    for (const highest of [0.05, 0.1, 0.2, 0.35]) {
      const used = all.filter((ring) => ring.k > 0.012 && ring.k <= highest);
      if (found && found.px > 1.4 / highest) break;
      if (used.length >= 3) found = fit(used, ratio, Math.min(1 / ratio, 2) / highest);
    }
    return found && found.sigmaPx < Math.max(1, 0.5 * found.px) ? found : null;
  };
})();
