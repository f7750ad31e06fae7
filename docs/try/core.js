"use strict";
// The C interface of the core (csrc/wasm/interface.h): a record in its loop, and the fits that were made to it.

const LOOPS = {
  open: 0,
  sampled: 1,
  continuous: 2
};

// The core's memory: numbers written before a call, and freed after it.
class Memory {
  constructor(module) {
    this.module = module;
    this.taken = [];
  }
  room(bytes) {
    const at = this.module._malloc(Math.max(bytes, 8));
    this.taken.push(at);
    return at;
  }
  doubles(values) {
    const at = this.room(8 * values.length);
    this.module.HEAPF64.set(values, at / 8);
    return at;
  }
  whole(values) {
    const at = this.room(4 * values.length);
    this.module.HEAP32.set(values, at / 4);
    return at;
  }
  read(at, n) { return this.module.HEAPF64.slice(at / 8, at / 8 + n); }
  free() { this.taken.forEach(at => this.module._free(at)); }
}

class Session {
  // loop: "open", "sampled" or "continuous"; controller: {kp, ki, torqueLimit}
  constructor(module, record, loop, controller, moving) {
    const {input, velocity, dt} = record, c = controller || {kp: 0, ki: 0};
    Object.assign(this, {module, n: velocity.length});
    const first = (velocity[0] + velocity[1] + velocity[2]) / 3;
    this.handle = this.with(
        m => module._gaident_open(
            m.doubles(input), m.doubles(velocity), this.n, dt, moving ? 1 : 0, first, LOOPS[loop],
            m.doubles([c.kp, c.ki, c.torqueLimit || Infinity, Infinity])));
    if (!this.handle) throw new Error(this.message());
  }
  close() { this.module._gaident_close(this.handle); }
  message() { return this.module.UTF8ToString(this.module._gaident_message()); }
  with(work) {
    const memory = new Memory(this.module);
    try {
      return work(memory);
    } finally {
      memory.free();
    }
  }
  checked(result) {
    if (result < 0) throw new Error(this.message());
    return result;
  }
  setRanges(s) {
    const all = [...s.gain, ...s.real, ...s.imaginary, ...s.p, ...s.q, s.bits, s.gainScale];
    this.with(m => this.checked(this.module._gaident_set_ranges(this.handle, m.doubles(all))));
  }
  // Fits of all structures.
  search(settings, seed) {
    const count = this.with(m => this.checked(this.module._gaident_search(this.handle, m.doubles(settings), seed)));
    return Array.from({length: count}, (_, i) => this.read(i));
  }
  fit(model, starts, iterations, tolerance) {
    const {gain, poles, zeros} = model;
    return this.read(this.with(
        m => this.checked(this.module._gaident_fit(
            this.handle, gain, m.doubles(poles.flat()), poles.length, m.doubles(zeros.flat()), zeros.length, m.doubles(starts),
            starts.length, iterations, tolerance))));
  }
  goOn(fit, phi, iterations, tolerance) {
    return this.read(this.with(
        m => this.checked(
            this.module._gaident_go_on(this.handle, fit.number, m.doubles(phi), phi.length, iterations, tolerance))));
  }
  read(number) {
    return this.with(m => {
      const at = m.room(8 * 128), count = this.checked(this.module._gaident_read_fit(this.handle, number, at));
      const v = Array.from(m.read(at, count)), [p, q, gain, cost, states] = v;
      const pairs = (from, n) => Array.from({length: n}, (_, i) => [v[from + 2 * i], v[from + 2 * i + 1]]);
      const behind = 5 + 2 * (p + q) + 2 * q;
      return {
        number,
        p,
        q,
        gain,
        cost,
        poles: pairs(5, p + q),
        zeros: pairs(5 + 2 * (p + q), q),
        size: 1 + p + 2 * q,
        starts: v.slice(behind, behind + states),
        atBound: v.slice(behind + states).map(x => x > 0)
      };
    });
  }
  // {products: sums of e(n) e(n+k), largest: velocity of the model}
  residualSums(fit, lags) {
    return this.with(m => {
      const at = m.room(8 * (lags + 2));
      const all = m.read(at, this.checked(this.module._gaident_residual_sums(this.handle, fit.number, lags, at)));
      return {products: Array.from(all.slice(0, lags + 1)), largest: all[lags + 1]};
    });
  }
  // {plain: J'J, coloured: J'SJ, white: X'X}
  fitSums(fit, phi, lags, threshold) {
    return this.with(m => {
      const room = 20000, at = m.room(8 * room);
      const k = this.checked(this.module._gaident_fit_sums(
          this.handle, fit.number, m.doubles(phi), phi.length, m.whole(lags), lags.length, threshold, at, room));
      const columns = 1 + k + lags.length + 3, all = Array.from(m.read(at, 2 * k * k + columns * columns));
      return {
        plain: square(all.slice(0, k * k), k),
        coloured: square(all.slice(k * k, 2 * k * k), k),
        white: square(all.slice(2 * k * k), columns)
      };
    });
  }
  simulate(fit) {
    return this.with(m => {
      const w = m.room(8 * this.n), u = m.room(8 * this.n);
      this.checked(this.module._gaident_simulate(this.handle, fit.number, w, u));
      return {velocity: m.read(w, this.n), torque: m.read(u, this.n)};
    });
  }
}
