"use strict";
// Curves over time as SVG. Of a long record the least and the largest value in each column of the picture.

function ticksOf(low, high, count) {
  const raw = (high - low) / count, power = 10 ** Math.floor(Math.log10(raw)),
        step = [1, 2, 5, 10].find(s => s * power >= raw) * power;
  const all = [];
  for (let x = Math.ceil(low / step) * step; x <= high + 1e-9 * step; x += step) all.push(Math.abs(x) < 1e-9 * step ? 0 : x);
  return all;
}

const shortNumber = x => String(Number(x.toPrecision(6)));

// curves: [{values, name, kind}], kind: a class of the style sheet.
function chart(title, unit, dt, curves) {
  const width = 900, height = 260, left = 62, right = 10, top = 12, bottom = 40, n = curves[0].values.length;
  let low = Infinity, high = -Infinity;
  for (const {values} of curves)
    for (const v of values) {
      low = Math.min(low, v);
      high = Math.max(high, v);
    }
  if (!(high > low)) [low, high] = [low - 1, high + 1];
  const pad = 0.04 * (high - low), end = Math.max(dt * (n - 1), dt);
  [low, high] = [low - pad, high + pad];
  const x = t => left + (width - left - right) * t / end, y = v => top + (height - top - bottom) * (high - v) / (high - low);
  const points = values => {
    const columns = width - left - right, all = [], add = i => all.push(`${x(i * dt).toFixed(1)},${y(values[i]).toFixed(1)}`);
    if (n <= 2 * columns)
      for (let i = 0; i < n; i++) add(i);
    else
      for (let c = 0; c < columns; c++) {
        const from = Math.floor(c * n / columns), to = Math.floor((c + 1) * n / columns);
        let least = from, most = from;
        for (let i = from; i < to; i++) {
          if (values[i] < values[least]) least = i;
          if (values[i] > values[most]) most = i;
        }
        add(Math.min(least, most));
        add(Math.max(least, most));
      }
    return all.join(" ");
  };
  const grid = ticksOf(low, high, 5)
                   .map(
                       v => `<line class="grid" x1="${left}" x2="${width - right}" y1="${y(v)}" y2="${y(v)}"/>` +
                           `<text x="${left - 6}" y="${y(v) + 4}" text-anchor="end">${shortNumber(v)}</text>`);
  const times = ticksOf(0, end, 8).map(
      t => `<line class="grid" x1="${x(t)}" x2="${x(t)}" y1="${top}" y2="${height - bottom}"/>` +
          `<text x="${x(t)}" y="${height - bottom + 16}" text-anchor="middle">${shortNumber(t)}</text>`);
  const drawn = curves.map(c => `<polyline class="${c.kind}" points="${points(c.values)}"/>`);
  const legend = curves.map(c => `<span class="key ${c.kind}">${c.name}</span>`).join(" ");
  const head = `<figcaption>${title} [${unit}] ${legend}</figcaption>`;
  const below = `<text x="${(left + width) / 2}" y="${height - 6}" text-anchor="middle">time [s]</text>`;
  return `<figure>${head}<svg viewBox="0 0 ${width} ${height}" role="img" aria-label="${title}">` +
    `${grid.join("")}${times.join("")}${drawn.join("")}${below}</svg></figure>`;
}
