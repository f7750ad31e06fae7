"use strict";
// What gaident/show/report/packing.py packed: letters -> bits -> LZMA (lc 3, lp 0, pb 0) -> text.
const gaidentUnpack = (letters, size) => {
  const value = (i) => {
    const c = letters.charCodeAt(i);
    return c - 35 - (c > 60);
  };
  const bytes = new Uint8Array(Math.ceil((letters.length / 2) * 13 / 8) + 8);
  let held = 0, count = 0, end = 0;
  for (let i = 0; i + 1 < letters.length; i += 2) {
    held = (held << 13) | (value(i) + 91 * value(i + 1));
    for (count += 13; count >= 8; count -= 8) bytes[end++] = (held >>> (count - 8)) & 255;
    held &= (1 << count) - 1;
  }

  // The range coder: every decision is a bit of its own probability, which learns.
  let range = 0xffffffff, code = 0, at = 0;
  for (let i = 0; i < 5; i++) code = ((code << 8) | bytes[at++]) >>> 0;
  const normal = () => {
    if (range < 0x1000000) {
      range = (range << 8) >>> 0;
      code = ((code << 8) | bytes[at++]) >>> 0;
    }
  };
  const chances = (n) => new Uint16Array(n).fill(1024);
  const bit = (p, i) => {
    const bound = (range >>> 11) * p[i];
    let found = 0;
    if (code < bound) {
      range = bound;
      p[i] += (2048 - p[i]) >>> 5;
    } else {
      range -= bound;
      code -= bound;
      p[i] -= p[i] >>> 5;
      found = 1;
    }
    normal();
    return found;
  };
  const tree = (p, from, bits) => {
    let m = 1;
    for (let i = 0; i < bits; i++) m = (m << 1) | bit(p, from + m);
    return m - (1 << bits);
  };
  const reversed = (p, from, bits) => {
    let m = 1, found = 0;
    for (let i = 0; i < bits; i++) {
      const b = bit(p, from + m);
      m = (m << 1) | b;
      found |= b << i;
    }
    return found;
  };
  const direct = (bits) => {
    let found = 0;
    for (let i = 0; i < bits; i++) {
      range >>>= 1;
      const b = code >= range ? 1 : 0;
      if (b) code -= range;
      found = (found << 1) | b;
      normal();
    }
    return found;
  };
  const lengths = () => ({ choice: chances(2), low: chances(8), middle: chances(8), high: chances(256) });
  const length = (p) => {
    if (!bit(p.choice, 0)) return 2 + tree(p.low, 0, 3);
    return bit(p.choice, 1) ? 18 + tree(p.high, 0, 8) : 10 + tree(p.middle, 0, 3);
  };

  const match = chances(12), again = chances(12), first = chances(12), second = chances(12), third = chances(12);
  const shortOne = chances(12), slots = [0, 1, 2, 3].map(() => chances(64)), near = chances(128), align = chances(16);
  const matchLengths = lengths(), againLengths = lengths(), literals = chances(0x300 * 8);
  const text = new Uint8Array(size);
  const back = [0, 0, 0, 0];  // the last four distances
  let n = 0, state = 0;
  while (n < size) {
    if (!bit(match, state)) {
      const base = 0x300 * ((n ? text[n - 1] : 0) >> 5);
      let symbol = 1;
      if (state >= 7) {
        for (let other = text[n - back[0] - 1]; symbol < 256; other <<= 1) {
          const expected = (other >> 7) & 1, b = bit(literals, base + ((1 + expected) << 8) + symbol);
          symbol = (symbol << 1) | b;
          if (b !== expected) break;
        }
      }
      while (symbol < 256) symbol = (symbol << 1) | bit(literals, base + symbol);
      text[n++] = symbol;
      state = state < 4 ? 0 : state < 10 ? state - 3 : state - 6;
      continue;
    }
    let many;
    if (bit(again, state)) {
      let which = 0;
      if (!bit(first, state)) {
        if (!bit(shortOne, state)) {
          text[n] = text[n - back[0] - 1];
          n += 1;
          state = state < 7 ? 9 : 11;
          continue;
        }
      } else {
        which = !bit(second, state) ? 1 : !bit(third, state) ? 2 : 3;
      }
      back.unshift(...back.splice(which, 1));
      many = length(againLengths);
      state = state < 7 ? 8 : 11;
    } else {
      many = length(matchLengths);
      state = state < 7 ? 7 : 10;
      const slot = tree(slots[Math.min(many - 2, 3)], 0, 6);
      let far = slot;
      if (slot >= 4) {
        const bits = (slot >> 1) - 1;
        far = (2 | (slot & 1)) << bits;
        if (slot < 14) far += reversed(near, far - slot, bits);
        else far += (direct(bits - 4) << 4) + reversed(align, 0, 4);
      }
      back.pop();
      back.unshift(far);
    }
    for (const end = Math.min(n + many, size), far = back[0] + 1; n < end; n++) text[n] = text[n - far];
  }
  return new TextDecoder().decode(text);
};
