"use strict";
// What is taken from a record before the search, as gaident's Python does it: its noise, whether it starts at rest, what drives
// it, the search ranges, and which part of a long record is searched. A record: {dt, velocity, torque or null, command or null}.

class DataError extends Error {}

// The torque of a PI controller, of the errors command - velocity.
function torqueOfController(record, c) {
  const limit = c.torqueLimit || Infinity, half = 0.5 * c.ki * record.dt;
  let last = 0, integral = 0;
  return record.velocity.map((w, n) => {
    const e = record.command[n] - w;
    integral += half * (e + last);
    last = e;
    return Math.min(Math.max(c.kp * e + integral, -limit), limit);
  });
}

// Noise of a smooth signal by its third differences, those of four equal values and more left out.
function noiseOf(w) {
  const thirds = [], n = w.length - 1, same = changes(w).map(x => x === 0), inRun = new Array(w.length).fill(false);
  for (let i = 0; i + 2 < n; i++)
    if (same[i] && same[i + 1] && same[i + 2]) inRun.fill(true, i, i + 4);
  for (let i = 0; i + 3 < w.length; i++)
    if (!inRun[i] && !inRun[i + 1] && !inRun[i + 2] && !inRun[i + 3])
      thirds.push(Math.abs(w[i + 3] - 3 * w[i + 2] + 3 * w[i + 1] - w[i]));
  return thirds.length ? 1.4826 * median(thirds) / Math.sqrt(20) : 0;
}

// By how much neighbouring values differ; 0 where that is no more than rounding.
function changes(w) {
  const top = largest(w), steps = [];
  for (let i = 0; i + 1 < w.length; i++) {
    const step = Math.abs(w[i + 1] - w[i]);
    steps.push(step <= POLICY.same * top ? 0 : step);
  }
  return steps;
}

function largest(values) {
  let top = 0;
  for (const x of values)
    if (Math.abs(x) > top) top = Math.abs(x);
  return top;
}

// Velocity up to which the axis stands.
function restOf(w) {
  const steps = changes(w), moved = steps.filter(x => x > 0);
  const quantum = moved.length && moved.length < POLICY.repeats * steps.length ? moved.reduce((a, b) => Math.min(a, b)) : 0;
  return Math.max(POLICY.above_noise * noiseOf(w), POLICY.rest_steps * quantum, POLICY.negligible * largest(w));
}

function startsMoving(record, loop) {
  const {velocity: w} = record, source = loop === "open" ? record.torque : record.command, first = w[0];
  if (loop === "continuous" && source[0] !== 0) {
    const passed = first / source[0];
    if (passed >= 0 && passed <= POLICY.rest_share) return false;
  }
  if (!(Math.abs(first) > restOf(w))) return false;
  const constant = source.every(x => x === source[0]);
  return !(constant && Math.abs(first) <= Math.max(POLICY.held_share * median(w.map(Math.abs)), restOf(w)));
}

// Where command and velocity go together, but in another unit or against one another.
function checkScales(record, onlyCertain) {
  const {command: r, velocity: w} = record, together = dot(r, w), size = Math.sqrt(dot(r, r) * dot(w, w));
  if (-POLICY.one_course * size > together)
    throw new DataError("The velocity runs against its command all along: reverse the sign of one of them (unit −1 ×).");
  if (!(together > POLICY.one_course * size && size > 0)) return;
  const factor = together / dot(w, w), near = POLICY.near_rpm, most = POLICY.same_unit;
  const isRpm = rate => factor / rate > 1 / near && factor / rate < near;
  const rpm = isRpm(9.549) ? "command" : isRpm(1 / 9.549) ? "velocity" : null;
  if ((factor >= 1 / most && factor <= most) || (onlyCertain && !rpm && factor > most)) return;
  throw new DataError(
      rpm ? `The ${rpm} seems to be in rpm, the other in rad/s: choose its unit.` :
            `The command is ${factor.toPrecision(3)} times the velocity all along: they are in different units; choose them.`);
}

// Search ranges from the data: see derive_space in python/gaident/identification/space.py.
function rangesOf(record, loop, controller) {
  if (loop !== "open") checkScales(record, true);
  const {dt, velocity: w} = record, u = record.torque || torqueOfController(record, controller), n = w.length;
  let energy = 0, steps = 0, U = 0, W = 0;
  const x = [[], [], w];
  for (let i = 0; i < n; i++) {
    if (i > 0) {
      U += 0.5 * dt * (u[i] + u[i - 1]);
      W -= 0.5 * dt * (w[i] + w[i - 1]);
      steps += (w[i] - w[i - 1]) * u[i - 1] * dt;
    }
    energy += u[i] * u[i] * dt * dt;
    x[0].push(U);
    x[1].push(W);
  }
  if (!(energy > 0))
    throw new DataError("The torque is 0 all along: nothing can be identified; use a record in which the drive moves.");
  if (w.every(v => v === w[0]))
    throw new DataError("The velocity is constant: nothing can be identified; use a record in which the drive moves.");
  const means = x.map(row => row.reduce((a, b) => a + b, 0) / n);
  const gram = (i, j) => {
    let s = 0;
    for (let k = 0; k < n; k++) s += (x[i][k] - means[i]) * (x[j][k] - means[j]);
    return s;
  };
  const a = gram(0, 0), b = gram(0, 1), c = gram(1, 1), det = a * c - b * b;
  const rigid = det > 1e-14 * Math.max(a, c) ** 2 ? (gram(0, 2) * c - gram(1, 2) * b) / det : 0;
  let found = [rigid, steps / energy].filter(k => Number.isFinite(k) && k > 0);
  if (!found.length) {
    if (loop !== "open") checkScales(record, false);
    if (loop !== "open" && !record.torque)
      found = [rigid, steps / energy].map(Math.abs).filter(k => Number.isFinite(k) && k !== 0);
  }
  if (!found.length)
    throw new DataError(
        "The velocity falls when the torque rises: reverse the sign of one of them (unit −1 ×). " +
        "An axis on a spring or under gravity shows the same; this page does not look for one, the Python package does.");
  const longest = n * dt, real = [-10 / longest, 1 / dt], imaginary = [Math.min(0.5 / longest, 0.1 / dt), 0.8 * Math.PI / dt];
  return {
    gain: [Math.min(...found) / 30, Math.max(...found) * 1000],
    real,
    imaginary,
    p: [loop === "continuous" ? 0 : 1, 3],
    q: [0, 3],
    bits: POLICY.bits,
    gainScale: 0.1 * Math.sqrt(Math.max(real[1], 1e-9) * imaginary[1])
  };
}

// What drives the model: the command of a loop, else the torque, which is held from line to line.
const driving = (record, loop) => (loop === "open" ? record.torque : record.command);

function slice(record, from, to) {
  const cut = x => x && x.slice(from, to);
  return {dt: record.dt, velocity: cut(record.velocity), torque: cut(record.torque), command: cut(record.command)};
}

// [first sample, end] of the part that is searched: the window that is excited most (python/gaident/identification/parts.py).
function searchedPart(record, loop, moving) {
  const n = record.velocity.length;
  const budget = Math.min(Math.max(POLICY.searched_samples, Math.floor(n / POLICY.searched_share)), POLICY.most_samples);
  if (n <= 2 * budget) return [0, n];
  const length = Math.max(POLICY.searched_samples / 2, budget), block = Math.floor(length / POLICY.grid),
        u = driving(record, loop);
  const blocks = [];
  for (let from = 0; from + block <= n; from += block) {
    let change = 0, sum = 0, squares = 0;
    for (let k = from; k < from + block; k++) {
      if (k + 1 < n) change += (u[k + 1] - u[k]) ** 2;
      sum += record.velocity[k];
      squares += record.velocity[k] ** 2;
    }
    blocks.push([change, sum, squares]);
  }
  const windows = [];
  for (let i = 0; i + POLICY.grid <= blocks.length; i++) {
    const [c, s, q] = [0, 1, 2].map(k => blocks.slice(i, i + POLICY.grid).reduce((total, b) => total + b[k], 0));
    windows.push([c, Math.max(q - s * s / (block * POLICY.grid), 0)]);
  }
  const top = [0, 1].map(k => Math.max(...windows.map(v => v[k]))),
        score = windows.map(v => v[0] / (top[0] || 1) + v[1] / (top[1] || 1));
  let best = score.indexOf(Math.max(...score));
  if (!moving && score[0] >= POLICY.from_rest * score[best]) best = 0;
  return [best * block, best * block + length];
}
