"use strict";
// A CSV file as columns of numbers, which column is what, and the record that is made of them. Errors are sentences for the
// reader.

class TableError extends Error {}

const KINDS = {
  time: {names: /^(time|t|zeit|timestamp)\b/i, units: {s: 1, ms: 1e-3, "µs": 1e-6}},
  command: {
    names: /(command|cmd|ref|soll|setpoint|target|desired)/i,
    not: /(torque|moment|current|position)/i,
    units: {"rad/s": 1, rpm: Math.PI / 30, "deg/s": Math.PI / 180, "−1 × rad/s": -1, "−1 × rpm": -Math.PI / 30}
  },
  torque: {names: /(torque|moment|\bM\b|\bu\b|trq)/i, units: {"N m": 1, "mN m": 1e-3, "−1 × N m": -1, "−1 × mN m": -1e-3}},
  velocity: {
    names: /(velocity|speed|omega|drehzahl|\bvel\b|\bw\b|\bist\b)/i,
    not: /(command|cmd|ref|soll|setpoint|target|desired)/i,
    units: {"rad/s": 1, rpm: Math.PI / 30, "deg/s": Math.PI / 180, "−1 × rad/s": -1, "−1 × rpm": -Math.PI / 30}
  },
};
const WRITTEN_UNITS = [
  [/\brpm\b|1\/min|min-1|u\/min/i, "rpm"], [/rad\/s/i, "rad/s"], [/deg\/s|°\/s/i, "deg/s"], [/mN ?m\b/i, "mN m"],
  [/\bN ?m\b/, "N m"], [/\bms\b/i, "ms"], [/[uµ]s\b/i, "µs"], [/\bs\b/, "s"]
];

// {names, columns: arrays of numbers, lines: of the file, where each row stands}
function readTable(text) {
  const lines = text.replace(/^\uFEFF/, "").split(/\r\n|\n|\r/);
  const filled = lines.map((line, i) => [line.trim(), i + 1]).filter(([line]) => line && !line.startsWith("#"));
  if (!filled.length) throw new TableError("The file is empty.");
  const probe = filled.slice(0, 40).map(([line]) => line).join("\n"), count = mark => probe.split(mark).length;
  const mark = [";", "\t"].find(m => count(m) > filled.slice(0, 40).length / 2) || (/,/.test(probe) ? "," : /\s+/);
  const comma = mark !== "," && /\d,\d/.test(probe) && !/\d\.\d/.test(probe);
  const split = line => line.split(mark).map(cell => cell.trim().replace(/^"(.*)"$/, "$1"));
  const number = cell => (cell === "" ? NaN : Number(comma ? cell.replace(",", ".") : cell));
  const first =
      filled.findIndex(([line]) => split(line).filter(cell => cell !== "").every(cell => Number.isFinite(number(cell))));
  if (first < 0)
    throw new TableError("No line of the file holds numbers only: give a CSV file with a line of names and lines of numbers.");
  const width = split(filled[first][0]).length;
  const header = filled.slice(0, first).map(([line]) => split(line)).filter(cells => cells.length === width);
  const names = Array.from({length: width}, (_, k) => header.map(cells => cells[k]).join(" ").trim() || `column ${k + 1}`);
  const columns = names.map(() => []), places = [];
  for (const [line, place] of filled.slice(first)) {
    const cells = split(line);
    if (cells.length !== width && !(cells.length > width && cells.slice(width).every(c => c === "")))
      throw new TableError(`Line ${place} has ${cells.length} columns, the lines before it ${width}.`);
    names.forEach((_, k) => columns[k].push(number(cells[k])));
    places.push(place);
  }
  return {names, columns, places};
}

// For each kind of column: its number, -1 where none looks like it, and its unit.
function guessColumns(table) {
  const taken = new Set(), found = {};
  for (const [kind, {names, not, units}] of Object.entries(KINDS)) {
    const at = table.names.findIndex((name, k) => !taken.has(k) && names.test(name) && !(not && not.test(name)));
    if (at >= 0) taken.add(at);
    const written =
        at >= 0 && WRITTEN_UNITS.find(([pattern, unit]) => unit in units && pattern.test(table.names[at].replace(/^\w+/, "")));
    found[kind] = {at, unit: written ? written[1] : Object.keys(units)[0]};
  }
  return found;
}

// choice: {time, command, torque, velocity: {at, unit}}, dt [s] where there is no time column; loop.
function recordOf(table, choice, dt, loop) {
  const need = ["velocity", loop === "open" ? "torque" : "command"];
  for (const kind of need)
    if (choice[kind].at < 0)
      throw new TableError(`Choose the column of the ${kind}: ` +
        (loop === "open" ? "without a controller the torque drives the model." : "in a loop the velocity command drives it."));
  const column = kind => {
    const {at, unit} = choice[kind];
    if (at < 0) return null;
    const bad = table.columns[at].findIndex(x => !Number.isFinite(x));
    if (bad >= 0) throw new TableError(`Line ${table.places[bad]}, column "${table.names[at]}": there is no number.`);
    return table.columns[at].map(x => x * KINDS[kind].units[unit]);
  };
  const used = Object.keys(KINDS).map(kind => choice[kind].at).filter(at => at >= 0);
  if (new Set(used).size < used.length) throw new TableError("One column is chosen twice.");
  const velocity = column("velocity"), n = velocity.length, time = column("time");
  if (n < POLICY.least_samples)
    throw new TableError(
        `The file has ${n} lines of numbers; at least ${POLICY.least_samples} are needed, and some hundred to say much.`);
  let step = dt;
  if (time) {
    step = (time[n - 1] - time[0]) / (n - 1);
    if (!(step > 0)) throw new TableError("The time does not rise from the first line to the last.");
    const off = time.findIndex((t, i) => Math.abs(t - time[0] - i * step) > 0.25 * step);
    if (off >= 0) {
      const places = (Math.abs(time[off] - time[0] - off * step) / step).toFixed(1);
      throw new TableError(`The lines are not evenly spaced in time: line ${table.places[off]} is ${places} sample times ` +
        "from its place. Samples are missing, or the file holds several recordings; cut it, or let the Python package read it.");
    }
  }
  if (!(step > 0)) throw new TableError("Choose the column of the time, or give the sample time.");
  return {dt: step, velocity, torque: column("torque"), command: column("command")};
}
