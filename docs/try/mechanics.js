"use strict";
// The mechanics of a model, as gaident's Python finds them (python/gaident/models/two_mass.py, two_mass_fit.py).
//
//     c = (K, sum A, pairwise A, product A, sum B, product B): G(s) = K (s^2 + c4 s + c5)/(s^3 + c1 s^2 + c2 s + c3)
//     phi = (K, m, l, b0, R): J_M = 1/K, D_M = m/K, J_L = R/K, D_L = l R/K, K_G = b0 R/K

const WEAK_DAMPING = 1e-3;

const phiByPairwise = ([K, sumA, pairA, , sumB, b0]) => [K, sumA - sumB, sumB, b0, (pairA - (sumA - sumB) * sumB) / b0 - 1];
const coefficientsOfPhi = ([K, m, l, b0, R]) => [K, m + l, b0 * (R + 1) + m * l, b0 * (m + l * R), l, b0];
const slopesOfPhi = ([, m, l, b0, R]) => [
    [1, 0, 0, 0, 0], [0, 1, 1, 0, 0], [0, l, m, R + 1, b0], [0, b0, b0 * R, m + l * R, b0 * l], [0, 0, 1, 0, 0], [0, 0, 0, 1, 0]];
const masses = ([K, m, l, b0, R]) => [1 / K, m / K, R / K, l * R / K, b0 * R / K, (1 + R) / K, (m + l * R) / K];
const MASS_NAMES = ["JM", "DM", "JL", "DL", "KG", "J", "D"];

// How far the two equations for the stiffness are apart.
function stiffnessGap(c) {
  const [, m, , , R] = phiByPairwise(c), [, , , productA, sumB, b0] = c;
  const weight = Math.max(Math.abs(sumB), WEAK_DAMPING * Math.sqrt(Math.abs(b0))) * Math.max(Math.abs(R), 1e-9);
  return (productA / b0 - m - sumB * R) / weight;
}

function coefficientScales(c) {
  const frequency = Math.sqrt(Math.max(Math.abs(c[5]), Math.abs(c[2])));
  return c.map((x, i) => Math.max(Math.abs(x), i === 0 ? 0 : WEAK_DAMPING * frequency ** [0, 1, 2, 3, 1, 2][i]));
}

const phiScales = phi => phi.map(
    (x, i) => Math.max(
        Math.abs(x),
        i === 1 || i === 2 ? WEAK_DAMPING * Math.sqrt(Math.abs(phi[3])) :
            i === 4        ? WEAK_DAMPING :
                             0));

// phi of least |whitening (coefficients(phi) - c)|, by Levenberg and Marquardt from the pairwise solution.
function leastSquaresPhi(c, whitening) {
  const start = phiByPairwise(c), size = phiScales(start);
  const at = moved => start.map((x, i) => x + size[i] * moved[i]);
  const error = moved => times(whitening, coefficientsOfPhi(at(moved)).map((x, i) => x - c[i]));
  let moved = [0, 0, 0, 0, 0], e = error(moved), cost = dot(e, e), damping = 1e-6;
  for (let round = 0; round < 200; round++) {
    const J = product(whitening, slopesOfPhi(at(moved)).map(row => row.map((x, i) => x * size[i])));
    const columns = transposed(J).map(column => Math.sqrt(dot(column, column)));
    const more = columns.map((x, i) => columns.map((_, j) => (i === j ? Math.sqrt(damping) * x : 0)));
    const step = leastSquares([...J, ...more], [...e.map(x => -x), 0, 0, 0, 0, 0]);
    const tried = moved.map((x, i) => x + step[i]), left = error(tried), reached = dot(left, left);
    if (reached <= cost) {
      const small = Math.sqrt(dot(step, step)) < 1e-11 * (1 + Math.sqrt(dot(tried, tried)));
      [moved, e, cost] = [tried, left, reached];
      damping = Math.max(damping / 10, 1e-15);
      if (small) break;
    } else if ((damping *= 10) > 1e12) break;
  }
  return at(moved);
}

// W with W cov W' = 1; directions nearly without variance get 1e-16 of the largest.
function whiteningOf(cov, scales) {
  const {values, vectors} = eigenvalues(cov.map((row, i) => row.map((x, j) => x / (scales[i] * scales[j]))));
  const top = values[values.length - 1];
  return vectors.map((row, k) => row.map((x, j) => x / Math.sqrt(Math.max(values[k], 1e-16 * top)) / scales[j]));
}

const deviations = (gradient, cov) => gradient.map(row => Math.sqrt(Math.max(dot(row, times(cov, row)), 0)));

// {structure, J, D, ... , std: {...}} of p = 1 and q = 0 or 2; null for other structures. cov: of c, null where it is not known.
function mechanicsOf(fit, c, cov) {
  const {p, q} = fit;
  if (p === 1 && q === 0) {
    const [K, a] = c, found = {structure: "one mass", J: 1 / K, D: a / K, std: {}};
    if (cov) [found.std.J, found.std.D] = deviations([[-1 / K ** 2, 0], [-a / K ** 2, 1 / K]], cov);
    return found;
  }
  if (p !== 1 || q !== 2 || c[5] === 0) return null;
  const scales = coefficientScales(c);
  const whitening = cov ? whiteningOf(cov, scales) : scales.map((x, i) => scales.map((_, j) => (i === j ? 1 / x : 0)));
  const phi = leastSquaresPhi(c, whitening), values = masses(phi), found = {structure: "two masses", std: {}};
  MASS_NAMES.forEach((name, i) => { found[name] = values[i]; });
  const [JM, , JL, , KG] = values;
  found.antiresonance = Math.sqrt(KG / JL);
  found.resonance = Math.sqrt(KG / JL + KG / JM);
  found.inconsistency = Math.abs(stiffnessGap(c));
  if (cov) {
    const size = phiScales(phi), A = product(whitening, slopesOfPhi(phi).map(row => row.map((x, i) => x * size[i])));
    const inverse = transposed(whitening.map((_, k) => leastSquares(A, whitening.map((__, i) => (i === k ? 1 : 0)))));
    const toPhi = product(inverse.map((row, i) => row.map(x => x * size[i])), whitening);
    const all = deviations(product(jacobian(masses, phi, size), toPhi), cov);
    MASS_NAMES.forEach((name, i) => { found.std[name] = all[i]; });
    [found.std.inconsistency] = deviations(jacobian(v => [stiffnessGap(v)], c, scales), cov);
  }
  return found;
}
