"use strict";
// identify() of one record around the core, with the default settings, as gaident's Python does it: the choice of the structure
// (python/gaident/identification/selection.py), the tests of the residual (adequacy.py), deviations (covariance.py).

const bic = (variance, count, numbers) => count * Math.log(Math.max(variance, 1e-300)) + numbers * Math.log(Math.max(count, 1));

// Coefficients phi of the autoregression that makes the residual white, its order by BIC, and the deviation of what is left.
function autoregressionOf(products, total) {
  const cov = products.map(x => x / total);
  if (!(cov[0] > 0)) return {phi: [], std: 0};
  let phi = [], variance = cov[0], best = {phi, std: Math.sqrt(variance)}, bestScore = bic(variance, total, 0);
  for (let m = 1; m < cov.length; m++) {
    const reflection = (cov[m] - phi.reduce((sum, f, i) => sum + f * cov[m - 1 - i], 0)) / variance;
    phi = [...phi.map((f, i) => f - reflection * phi[phi.length - 1 - i]), reflection];
    variance *= 1 - reflection ** 2;
    if (!(variance > 1e-14 * cov[0])) break;
    const score = bic(variance, total, m);
    if (score < bestScore) [best, bestScore] = [{phi, std: Math.sqrt(variance)}, score];
  }
  return best;
}

const highestOrder = n => Math.max(0, Math.min(30, Math.floor(n / 20), n - 1));
const tolerance = n => 0.01 / n;

// Zeros with a pole next to them.
function cancellations(fit) {
  const distance = (a, b) => Math.hypot(a[0] - b[0], a[1] - b[1]), free = [...fit.poles];
  let count = 0;
  for (const zero of fit.zeros) {
    const near = free.filter(pole => distance(pole, zero) < POLICY.cancellation * Math.max(Math.hypot(...zero), 1e-12));
    if (!near.length) continue;
    near.sort((a, b) => distance(a, zero) - distance(b, zero));
    free.splice(free.indexOf(near[0]), 1);
    count++;
  }
  return count;
}

// The fits with their BIC under one noise model.
function scored(session, fits, noise) {
  let count = session.n, costs = fits.map(f => f.cost);
  if (noise.phi.length) {
    costs = fits.map(f => session.goOn(f, noise.phi, POLICY.whitened_again, tolerance(session.n)).cost);
    count -= noise.phi.length;
  }
  return fits.map(
      (f, i) => ({...f, bic: bic(costs[i] / count, count, f.size + f.starts.length) + POLICY.rival_margin * cancellations(f)}));
}

const noiseModel = (session, fit) => autoregressionOf(session.residualSums(fit, highestOrder(session.n)).products, session.n);
const cheapest = fits => fits.reduce((a, b) => (b.cost < a.cost ? b : a));
const isChain = f => f.p === 1 && f.q % 2 === 0;

// The smallest structure within the margin of the best.
function smallestClose(fits) {
  const best = Math.min(...fits.map(f => f.bic)), close = fits.filter(f => f.bic <= best + POLICY.rival_margin);
  return close.reduce((a, b) => (b.size < a.size || (b.size === a.size && b.bic < a.bic) ? b : a));
}

// Where the data contradict every structure: the smallest chain of masses, one mass more only where it halves the error.
function smallestMechanism(fits, count) {
  const chains = fits.filter(isChain).sort((a, b) => a.q - b.q);
  return chains.reduce((a, b) => (b.bic < a.bic - count * Math.log(POLICY.another_mass) ? b : a), chains[0] || null);
}

// The fit taken to the end, then once more without a step, from its roots.
function refined(session, fit) {
  const done = session.goOn(fit, [], POLICY.final, 1e-9), best = done.cost <= fit.cost ? done : fit;
  return {...session.fit(best, best.starts, 0, 1e-9), bic: fit.bic};
}

// Rows that make columns of unit power orthonormal.
function orthonormal(gram) {
  if (!gram.length) return [];
  const {values, vectors} = eigenvalues(gram), top = values[values.length - 1];
  return vectors.map((v, k) => v.map(x => x / Math.sqrt(values[k]))).filter((_, k) => values[k] > 1e-10 * top);
}

// p-value of the F-test that the columns behind the first `own` explain nothing more of the residual (column 0).
function independence(sums, own, samples) {
  const diagonal = sums.map((row, i) => row[i]), sound = diagonal.map(x => Number.isFinite(x) && x > 0);
  const scale = diagonal.map((x, i) => (i === 0 ? 1 : sound[i] ? Math.sqrt(x) : Infinity));
  const G = sums.map((row, i) => row.map((x, j) => (Number.isFinite(x) ? x : 0) / scale[i] / scale[j]));
  const all = sums.map((_, i) => i), mine = all.filter(i => i >= 1 && i <= own && sound[i]),
        others = all.filter(i => i > own && sound[i]);
  const basis = orthonormal(part(G, mine, mine)), ofV = times(basis, mine.map(i => G[i][0]));
  const ofOthers = basis.length ? product(basis, part(G, mine, others)) : [];
  const explainedBy = (i, j) => ofOthers.reduce((sum, row) => sum + row[i] * row[j], 0);
  const cross = others.map((o, i) => G[o][0] - ofOthers.reduce((sum, row, k) => sum + row[i] * ofV[k], 0));
  const more = others.map((a, i) => others.map((b, j) => G[a][b] - explainedBy(i, j)));
  const keep = others.map((_, i) => i).filter(i => more[i][i] > 1e-8);
  if (!keep.length) return 1;
  const root = keep.map(i => Math.sqrt(more[i][i]));
  const directions = orthonormal(part(more, keep, keep).map((row, i) => row.map((x, j) => x / root[i] / root[j])));
  const explained = times(directions, keep.map((i, k) => cross[i] / root[k])).reduce((sum, x) => sum + x * x, 0);
  const left = G[0][0] - dot(ofV, ofV) - explained, m = directions.length, freedom = samples - basis.length - m;
  if (freedom < 1 || !(left > 0)) return explained > 0 ? 0 : 1;
  return fTail(explained / m / (left / freedom), m, freedom);
}

// Whether the data contradict a fit, and the sums that its deviations are made of.
function assessed(session, fit, loop, quiet) {
  const n = session.n, order = highestOrder(n),
        whiteLags = Math.min(POLICY.white_lags, Math.floor(n / POLICY.samples_per_white_lag));
  const {products, largest: top} = session.residualSums(fit, Math.max(order, whiteLags));
  const noise = autoregressionOf(products.slice(0, order + 1), n), lags = loop === "open" ? [] : [0];
  for (let k = 1; k <= POLICY.input_lag; k *= 2) lags.push(k);
  const used = lags.filter(k => k < Math.floor(n / POLICY.samples_per_input_lag));
  const sums = session.fitSums(fit, noise.phi, used, POLICY.no_direction * top), power = products[0] / n;
  let statistic = 0;
  for (let k = 1; k <= whiteLags; k++) statistic += (products[k] / products[0]) ** 2 / (n - k);
  const whiteP = products[0] > 0 ? chiSquareTail(n * (n + 2) * statistic, whiteLags) : 1;
  const excess = quiet > 0 ? Math.sqrt(power) / quiet : power === 0 ? 0 : Infinity;
  const p = independence(sums.white, sums.plain.length, n - noise.phi.length), falsified = p < POLICY.test_level;
  return {
    fit,
    noise,
    sums,
    adequacy: {
      whiteP,
      independenceP: p,
      excess,
      noiseStd: noise.std,
      falsified,
      undecided: !falsified && whiteP < POLICY.test_level && excess > POLICY.undecided_ratio
    }
  };
}

// Covariance of the core's parameters (gain, e1 and e0 of pairs, single roots): a row of NaN at a bound, infinite where it is not
// determined.
function covarianceOf({fit, noise, sums}) {
  const count = fit.atBound.length, {plain, coloured} = sums, scale = plain.map((row, i) => Math.sqrt(row[i]));
  const shown = plain.map((_, i) => i).filter(i => !(i < count && fit.atBound[i]) && scale[i] > 0 && Number.isFinite(scale[i]));
  const scaled = A => part(A, shown, shown).map((row, i) => row.map((x, j) => x / scale[shown[i]] / scale[shown[j]]));
  const {values, vectors} = eigenvalues(scaled(plain)), top = values[values.length - 1];
  const known = values.map(v => v > 1e-13 * top);
  const inverse =
      shown.map((_, i) => shown.map((__, j) => vectors.reduce((sum, v, k) => sum + (known[k] ? v[i] * v[j] / values[k] : 0), 0)));
  const small = product(product(inverse, scaled(coloured)), inverse);
  const lost = shown.map((_, i) => vectors.reduce((sum, v, k) => sum + (known[k] ? 0 : v[i] ** 2), 0) > 1e-6);
  const cov = Array.from(
      {length: count},
      (_, i) => Array.from(
          {length: count},
          (__, j) =>
              (fit.atBound[i] || fit.atBound[j] ? NaN :
                   i === j                      ? Infinity :
                                                  0)));
  shown.forEach((a, i) => shown.forEach((b, j) => {
    if (a < count && b < count && !lost[i] && !lost[j])
      cov[a][b] = noise.std ** 2 * 0.5 * (small[i][j] + small[j][i]) / scale[a] / scale[b] * (a === 0 ? fit.gain : 1) *
          (b === 0 ? fit.gain : 1);
  }));
  return cov;
}

// The core's parameters of a fit, from its roots in the core's order (two of a pair, then the single one).
function parametersOf(fit) {
  const factors = roots => {
    const all = [];
    for (let i = 0; i + 1 < roots.length; i += 2) {
      const [a, b] = [roots[i], roots[i + 1]];
      all.push(-(a[0] + b[0]), a[0] * b[0] - a[1] * b[1]);
    }
    if (roots.length % 2) all.push(-roots[roots.length - 1][0]);
    return all;
  };
  return [fit.gain, ...factors(fit.poles), ...factors(fit.zeros)];
}

// (K, coefficients of the denominator, of the numerator) of the core's parameters.
function coefficientsOf(x, poles) {
  const expanded = factors => {
    let polynomial = [1];
    const multiplied = by => {
      const result = new Array(polynomial.length + by.length - 1).fill(0);
      polynomial.forEach((a, i) => by.forEach((b, j) => { result[i + j] += a * b; }));
      polynomial = result;
    };
    for (let i = 0; i + 1 < factors.length; i += 2) multiplied([1, factors[i], factors[i + 1]]);
    if (factors.length % 2) multiplied([1, factors[factors.length - 1]]);
    return polynomial.slice(1);
  };
  return [x[0], ...expanded(x.slice(1, 1 + poles)), ...expanded(x.slice(1 + poles))];
}

// Roots as an engineer reads them: [{kind, real, imaginary, frequency (Hz), damping, std: {...}, atBound}].
function rootsOf(fit, cov) {
  const x = parametersOf(fit), found = [];
  const std = (f, at) =>
      deviations(jacobian(v => [f(v)], at.map(i => x[i]), at.map(i => Math.max(Math.abs(x[i]), 1e-9))), part(cov, at, at))[0];
  const walk = (kind, roots, first) => {
    let at = first;
    for (let i = 0; i < roots.length; i += 2, at += 2) {
      const own = i + 1 < roots.length ? [at, at + 1] : [at], atBound = own.some(k => fit.atBound[k]);
      if (roots[i][1] !== 0) {
        const frequency = ([, e0]) => Math.sqrt(e0) / (2 * Math.PI), damping = ([e1, e0]) => 0.5 * e1 / Math.sqrt(e0),
              v = own.map(k => x[k]);
        found.push({
          kind,
          real: roots[i][0],
          imaginary: Math.abs(roots[i][1]),
          frequency: frequency(v),
          damping: damping(v),
          atBound,
          std: {frequency: std(frequency, own), damping: std(damping, own)}
        });
      } else if (own.length === 2) {
        const half = ([e1, e0]) => Math.sqrt(Math.max(0.25 * e1 * e1 - e0, 0));
        const near = v => -(0.5 * v[0] - half(v)), far = v => -(0.5 * v[0] + half(v));
        for (const root of [near, far])
          found.push({kind, real: root(own.map(k => x[k])), imaginary: 0, atBound, std: {real: std(root, own)}});
      } else found.push({kind, real: roots[i][0], imaginary: 0, atBound, std: {real: std(v => -v[0], own)}});
    }
  };
  walk("pole", fit.poles, 1);
  walk("zero", fit.zeros, 1 + fit.poles.length);
  return found;
}

// Covariance with parameters at a bound taken as known; null where the record does not determine one.
function usableCovariance(cov) {
  if (cov.some((row, i) => row[i] === Infinity)) return null;
  return cov.map((row, i) => row.map((x, j) => (Number.isNaN(x) ? 0 : x)));
}

// record: {dt, velocity, torque, command}; loop: "open", "sampled", "continuous"; controller: {kp, ki, torqueLimit} of a loop.
function identify(module, record, loop, controller, seed, tell) {
  const moving = startsMoving(record, loop), ranges = rangesOf(record, loop, controller), quiet = noiseOf(record.velocity);
  const [from, to] = searchedPart(record, loop, moving), n = record.velocity.length, inPart = to - from < n;
  const sessionOf = (r, inMotion) => {
    const session = new Session(module, {...r, input: driving(r, loop)}, loop, controller, inMotion);
    session.setRanges(ranges);
    return session;
  };
  const whole = sessionOf(record, moving);
  const searched = inPart ? sessionOf(slice(record, from, to), from === 0 ? moving : true) : whole;
  let fits = searched.search(SETTINGS, seed).filter(f => f.cost < 1e300), others = [];
  if (!fits.length)
    throw new DataError("Every candidate diverged: the command, the velocity and the gains do not belong together.");
  tell("compare");
  const onAll = some => some.map(f => whole.fit(f, [], POLICY.whole_record, tolerance(n))).filter(f => f.cost < 1e300);
  if (inPart) {
    const scores = scored(searched, fits, noiseModel(searched, cheapest(fits)));
    const reach = Math.min(...scores.map(f => f.bic)) + Math.log(POLICY.part_reach) * searched.n;
    others = scores.filter(f => f.bic > reach);
    fits = onAll(scores.filter(f => f.bic <= reach));
  }
  const noise = noiseModel(whole, cheapest(fits)), winner = scored(whole, fits, noise);
  let scores = winner, chosen = smallestClose(scores), best = assessed(whole, refined(whole, chosen), loop, quiet);
  if (best.adequacy.falsified) {
    scores = [...scores, ...scored(whole, onAll(others.filter(isChain)), noise)];
    const chain = smallestMechanism(scores, n);
    if (chain && chain !== chosen) best = assessed(whole, refined(whole, chain), loop, quiet);
  }
  return reported(whole, best, scores, record, ranges, moving);
}

function reported(session, best, scores, record, ranges, moving) {
  const {fit, adequacy} = best, lowest = Math.min(...scores.map(f => f.bic)), cov = covarianceOf(best),
              usable = usableCovariance(cov);
  const x = parametersOf(fit), poles = fit.poles.length, c = coefficientsOf(x, poles);
  const ofC = usable &&
      (toC => product(product(toC, usable), transposed(toC)))(jacobian(
          v => coefficientsOf(v, poles), x,
          x.map(
              (v, i) => Math.max(Math.abs(v), i === 0 ? 0 : WEAK_DAMPING * Math.max(...fit.poles.map(r => Math.hypot(...r)))))));
  const larger = lowest < fit.bic - POLICY.rival_margin;
  const rivals = adequacy.falsified || larger ?
      [] :
      scores.filter(f => f.bic <= fit.bic + POLICY.rival_margin && (f.p !== fit.p || f.q !== fit.q));
  const run = session.simulate(fit), w = record.velocity, mean = w.reduce((a, b) => a + b, 0) / w.length;
  const sum = w.reduce((s, v, i) => s + (v - run.velocity[i]) ** 2, 0), spread = w.reduce((s, v) => s + (v - mean) ** 2, 0);
  const result = {
    p: fit.p,
    q: fit.q,
    gain: fit.gain,
    gainStd: Math.sqrt(cov[0][0]),
    roots: rootsOf(fit, cov),
    mechanics: mechanicsOf(fit, c, ofC),
    rmse: Math.sqrt(sum / w.length),
    fitPercent: spread > 0 ? 100 * (1 - Math.sqrt(sum / spread)) : NaN,
    samples: w.length,
    dt: record.dt,
    adequacy,
    larger,
    moving,
    rivals: rivals.map(f => ({p: f.p, q: f.q, bic: f.bic - fit.bic})),
    ranges,
    structures: scores.map(f => ({p: f.p, q: f.q, errorSum: f.cost, bic: f.bic - lowest})).sort((a, b) => a.bic - b.bic)
  };
  return {result, velocity: run.velocity, torque: run.torque};
}
