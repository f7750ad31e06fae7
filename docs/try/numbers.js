"use strict";
// What NumPy and SciPy do in Python, for the few small matrices of an identification. A matrix is an array of rows.

const dot = (a, b) => {
  let sum = 0;
  for (let i = 0; i < a.length; i++) sum += a[i] * b[i];
  return sum;
};
const transposed = A => A[0].map((_, j) => A.map(row => row[j]));
const product = (A, B) => {
  const C = transposed(B);
  return A.map(row => C.map(column => dot(row, column)));
};
const times = (A, x) => A.map(row => dot(row, x));
const square = (values, n) => Array.from({length: n}, (_, i) => Array.from(values.slice(i * n, (i + 1) * n)));
const part = (A, rows, columns) => rows.map(i => columns.map(j => A[i][j]));

// Eigenvalues in ascending order, and eigenvectors as rows, of a symmetric matrix: Jacobi's rotations.
function eigenvalues(S) {
  const n = S.length, A = S.map(row => Array.from(row)), V = S.map((_, i) => S.map((_, j) => (i === j ? 1 : 0)));
  for (let sweep = 0; sweep < 60; sweep++) {
    let off = 0;
    for (let i = 0; i < n; i++)
      for (let j = 0; j < i; j++) off += A[i][j] ** 2;
    if (!(off > 1e-40)) break;
    for (let p = 0; p < n; p++)
      for (let q = p + 1; q < n; q++) {
        if (A[p][q] === 0) continue;
        const angle = (A[q][q] - A[p][p]) / (2 * A[p][q]);
        const t = (angle >= 0 ? 1 : -1) / (Math.abs(angle) + Math.hypot(angle, 1)), c = 1 / Math.hypot(t, 1), s = t * c;
        for (let k = 0; k < n; k++) [A[k][p], A[k][q]] = [c * A[k][p] - s * A[k][q], s * A[k][p] + c * A[k][q]];
        for (let k = 0; k < n; k++) [A[p][k], A[q][k]] = [c * A[p][k] - s * A[q][k], s * A[p][k] + c * A[q][k]];
        for (let k = 0; k < n; k++) [V[p][k], V[q][k]] = [c * V[p][k] - s * V[q][k], s * V[p][k] + c * V[q][k]];
      }
  }
  const order = S.map((_, i) => i).sort((i, j) => A[i][i] - A[j][j]);
  return {values: order.map(i => A[i][i]), vectors: order.map(i => V[i])};
}

// x of least |A x - b|, by Householder reflections; A has at least as many rows as columns.
function leastSquares(A, b) {
  const R = A.map((row, i) => [...row, b[i]]), m = R.length, n = A[0].length;
  for (let k = 0; k < n; k++) {
    let size = 0;
    for (let i = k; i < m; i++) size = Math.hypot(size, R[i][k]);
    if (size === 0) continue;
    const alpha = R[k][k] > 0 ? -size : size, v = [];
    for (let i = k; i < m; i++) v.push(R[i][k] - (i === k ? alpha : 0));
    const length = dot(v, v);
    for (let j = k; j <= n; j++) {
      let s = 0;
      for (let i = k; i < m; i++) s += v[i - k] * R[i][j];
      for (let i = k; i < m; i++) R[i][j] -= 2 * s / length * v[i - k];
    }
  }
  const x = new Array(n).fill(0);
  for (let k = n - 1; k >= 0; k--) {
    let rest = R[k][n];
    for (let j = k + 1; j < n; j++) rest -= R[k][j] * x[j];
    x[k] = R[k][k] === 0 ? 0 : rest / R[k][k];
  }
  return x;
}

// d f/d x by central differences of 1e-6 of each scale.
function jacobian(f, x, scale) {
  const columns = x.map((_, i) => {
    const up = [...x], down = [...x];
    up[i] += 1e-6 * scale[i];
    down[i] -= 1e-6 * scale[i];
    const a = f(up), b = f(down);
    return a.map((value, k) => (value - b[k]) / (up[i] - down[i]));
  });
  return transposed(columns);
}

function median(values) {
  const x = Float64Array.from(values).sort(), n = x.length;
  return n === 0 ? NaN : n % 2 ? x[(n - 1) / 2] : 0.5 * (x[n / 2 - 1] + x[n / 2]);
}

// ln Gamma (Lanczos).
function logGamma(x) {
  const c = [
    676.5203681218851, -1259.1392167224028, 771.32342877765313, -176.61502916214059, 12.507343278686905, -0.13857109526572012,
    9.9843695780195716e-6, 1.5056327351493116e-7
  ];
  if (x < 0.5) return Math.log(Math.PI / Math.abs(Math.sin(Math.PI * x))) - logGamma(1 - x);
  let sum = 0.99999999999980993;
  for (let i = 0; i < 8; i++) sum += c[i] / (x + i);
  const t = x + 6.5;
  return 0.5 * Math.log(2 * Math.PI) + (x - 0.5) * Math.log(t) - t + Math.log(sum);
}

// A continued fraction b0 + a1/(b1 + a2/(b2 + ...)) by Lentz's method; term(i) is [ai, bi].
function fraction(first, term) {
  let f = first || 1e-300, C = f, D = 0;
  for (let i = 1; i < 10000; i++) {
    const [a, b] = term(i);
    D = 1 / (b + a * D || 1e-300);
    C = b + a / C || 1e-300;
    f *= C * D;
    if (Math.abs(C * D - 1) < 1e-15) break;
  }
  return f;
}

// The regularised incomplete beta function I_x(a, b).
function beta(x, a, b) {
  if (x <= 0) return 0;
  if (x >= 1) return 1;
  if (x > (a + 1) / (a + b + 2)) return 1 - beta(1 - x, b, a);
  const front = Math.exp(logGamma(a + b) - logGamma(a) - logGamma(b) + a * Math.log(x) + b * Math.log1p(-x)) / a;
  return front / fraction(1, i => {
           const m = Math.floor(i / 2);
           const d = i % 2 ? -(a + m) * (a + b + m) * x / ((a + 2 * m) * (a + 2 * m + 1)) :
                             m * (b - m) * x / ((a + 2 * m - 1) * (a + 2 * m));
           return [d, 1];
         });
}

// P(F > x) for m and n degrees of freedom.
const fTail = (x, m, n) => (x > 0 ? beta(n / (n + m * x), n / 2, m / 2) : 1);

// P(chi-square > x) for n degrees of freedom.
function chiSquareTail(x, n) {
  const a = n / 2, y = x / 2;
  if (!(y > 0)) return 1;
  const front = Math.exp(a * Math.log(y) - y - logGamma(a));
  if (y > a + 1) return front / fraction(y + 1 - a, i => [-i * (i - a), y + 2 * i + 1 - a]);
  let term = 1 / a, sum = term;
  for (let k = 1; k < 10000 && term > 1e-16 * sum; k++) sum += term *= y / (a + k);
  return 1 - front * sum;
}
