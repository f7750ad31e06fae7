"use strict";
// The page: a file or the example, the form, the worker, the result.

const $ = id => document.getElementById(id);
const escaped = text => String(text).replace(/[&<>"]/g, c => ({"&": "&amp;", "<": "&lt;", ">": "&gt;", "\"": "&quot;"}[c]));
let table = null, source = "", worker = null, result = null, clock = 0;

const say = (text, wrong = false) => {
  $("message").textContent = text;
  $("message").className = wrong ? "wrong" : "";
};

function workerOf() {
  const code = $("core").textContent + "\n;" + $("worker").textContent;
  const url = URL.createObjectURL(new Blob([code], {type: "text/javascript"}));
  const made = new Worker(url);
  URL.revokeObjectURL(url);
  made.onerror = event => {
    stop();
    say(`The browser could not run the core: ${event.message || "its worker did not start"}.`, true);
  };
  return made;
}

// While work is under way; on a message `taken` says whether it is the last.
function work(request, taken) {
  stop();
  worker = workerOf();
  worker.onmessage = ({data}) => {
    if (data.wrong) {
      stop();
      say(data.wrong, true);
    } else if (taken(data)) stop();
  };
  worker.postMessage(request);
  $("cancel").hidden = false;
  $("run").disabled = true;
}

function stop() {
  if (worker) worker.terminate();
  worker = null;
  clearInterval(clock);
  $("cancel").hidden = true;
  $("progress").hidden = true;
  $("run").disabled = table === null;
}

function show(found, name) {
  table = found;
  source = name;
  const guess = guessColumns(table);
  for (const kind of Object.keys(KINDS)) {
    const options = ["—", ...table.names].map((text, k) => `<option value="${k - 1}">${escaped(text)}</option>`);
    $(`${kind}-column`).innerHTML = options.join("");
    $(`${kind}-column`).value = guess[kind].at;
    $(`${kind}-unit`).value = guess[kind].unit;
  }
  $("loop").value = guess.torque.at < 0 && guess.command.at >= 0 ? "sampled" : "open";
  $("columns").hidden = false;
  $("result").hidden = true;
  $("file-name").textContent = `${name}: ${table.columns[0].length} lines, ${table.names.length} columns`;
  say("");
  changed();
  stop();
}

function changed() {
  const closed = $("loop").value !== "open";
  $("gains").hidden = !closed;
  $("dt-field").hidden = $("time-column").value !== "-1";
}

async function take(file) {
  try {
    show(readTable(await file.text()), file.name);
  } catch (wrong) {
    say(wrong instanceof TableError ? `${file.name}: ${wrong.message}` : `${file.name} cannot be read: ${wrong.message}`, true);
  }
}

function example() {
  say("The core makes a record …");
  work({example: true}, ({record}) => {
    if (!record) return false;
    const n = record.velocity.length, time = Array.from({length: n}, (_, i) => i * record.dt),
          {command, torque, velocity} = record;
    const names = ["time [s]", "command [rad/s]", "torque [N m]", "velocity [rad/s]"];
    show({names, columns: [time, command, torque, velocity], places: time.map((_, i) => i + 2)}, "Example");
    $("kp").value = EXAMPLE.controller.kp;
    $("ki").value = EXAMPLE.controller.ki;
    run();
    return false;
  });
}

function gain(id, name, least) {
  const value = Number($(id).value.replace(",", "."));
  if ($(id).value.trim() === "" || !Number.isFinite(value) || value < least)
    throw new TableError(`Give the controller's ${name}, a number not below ${least}.`);
  return value;
}

function run() {
  try {
    const loop = $("loop").value, choice = {};
    for (const kind of Object.keys(KINDS)) choice[kind] = {at: Number($(`${kind}-column`).value), unit: $(`${kind}-unit`).value};
    const record = recordOf(table, choice, Number($("dt").value.replace(",", ".")) / 1000, loop);
    const limit = $("limit").value.trim() === "" ? null : gain("limit", "torque limit", 1e-12);
    const controller = loop === "open" ? null : {kp: gain("kp", "kp", 0), ki: gain("ki", "ki", 0), torqueLimit: limit};
    if (controller && !(controller.kp + controller.ki > 0)) throw new TableError("kp and ki are both 0: that is no controller.");
    const began = Date.now();
    let stage = "The core starts";
    work({record, loop, controller, seed: 0}, data => {
      if (data.progress) {
        const p = data.progress;
        stage = p.stage ? "The structures are compared" :
                          `Generation ${p.done}` + (p.p < 0 ? "" : `, structure (${p.p},${p.q}) leads`);
        return false;
      }
      finished(data.done, record, loop, controller);
      return true;
    });
    const tick = () => say(`${stage} … ${((Date.now() - began) / 1000).toFixed(0)} s`);
    $("progress").hidden = false;
    clock = setInterval(tick, 200);
    tick();
  } catch (wrong) {
    stop();
    say(wrong.message, true);
  }
}

const rounded = (x, digits = 4) => (Number.isFinite(x) ? String(Number(x.toPrecision(digits))) : "—");
const SUPERSCRIPTS = "⁰¹²³⁴⁵⁶⁷⁸⁹";
// Value and deviation, with one power of ten for both where the value is small or large.
function within(x, std) {
  const power = x === 0 ? 0 : Math.floor(Math.log10(Math.abs(x))), far = power < -2 || power > 5, scale = far ? 10 ** power : 1;
  const text = rounded(x / scale) + (Number.isFinite(std) ? ` ± ${rounded(std / scale, 2)}` : "");
  const exponent = (power < 0 ? "⁻" : "") + String(Math.abs(power)).replace(/\d/g, d => SUPERSCRIPTS[d]);
  return far ? `(${text})·10${exponent}` : text;
}
const rows = list =>
    list.map(cells => `<tr>${cells.map((c, k) => `<${k ? "td" : "th"}>${c}</${k ? "td" : "th"}>`).join("")}</tr>`).join("");

function mechanicsRows(m) {
  const s = m.std || {}, of = (name, key, unit) => [name, within(m[key], s[key]), unit];
  if (m.structure === "one mass") return [of("Inertia J", "J", "kg m²"), of("Viscous friction D", "D", "N m s/rad")];
  return [
    of("Inertia of the motor J<sub>M</sub>", "JM", "kg m²"), of("Inertia of the load J<sub>L</sub>", "JL", "kg m²"),
    of("Whole inertia J", "J", "kg m²"), of("Stiffness of the shaft K<sub>G</sub>", "KG", "N m/rad"),
    of("Viscous friction at the motor D<sub>M</sub>", "DM", "N m s/rad"),
    of("Viscous friction at the load D<sub>L</sub>", "DL", "N m s/rad"), of("Whole viscous friction D", "D", "N m s/rad"),
    ["Resonance", rounded(m.resonance / (2 * Math.PI)), "Hz"], ["Antiresonance", rounded(m.antiresonance / (2 * Math.PI)), "Hz"]
  ];
}

function rootRow(r) {
  const name = `${r.kind === "pole" ? "Pole" : "Zero"}${r.imaginary ? "s (a pair)" : ""}`,
        bound = r.atBound ? " (at the end of its search range)" : "";
  return r.imaginary ?
      [
        name, `${within(r.frequency, r.std.frequency)} Hz, damping ${within(r.damping, r.std.damping)}${bound}`,
        `${rounded(r.real)} ± ${rounded(r.imaginary)} i rad/s`
      ] :
      [name, `${within(r.real, r.std.real)} rad/s${bound}`, ""];
}

// What to doubt, in sentences; unlooped: whether a torque drives the model that a controller made.
function doubts(r, unlooped) {
  const a = r.adequacy, m = r.mechanics, std = m && m.std && m.std.inconsistency;
  const [p, excess] = [rounded(a.independenceP, 2), rounded(a.excess, 2)];
  const gap = m && rounded(100 * m.inconsistency, 2), rivals = r.rivals.map(s => `(${s.p},${s.q})`).join(", ");
  const all = [
    a.falsified && `<strong>The linear model is contradicted</strong> (p = ${p}): what it leaves still depends on the ` +
      "torque or the motion. Something is missing, friction for example; its numbers are not to be trusted. " +
      "The Python package's diagnosis looks for the cause.",
    a.undecided && `What the model leaves is not white, and ${excess} times the noise of the velocity: ` +
      "coloured noise, or something is missing.",
    r.larger && "Larger structures come closer, but only by absorbing what no linear structure holds; " +
      "the smallest mechanism is shown.",
    rivals && `Nearly as good by BIC: ${rivals}; the smallest structure is shown.`,
    r.roots.some(s => s.atBound) && "A root stands at the end of its search range: doubt the structure.",
    r.moving && "The record starts in motion: its start state was estimated with the parameters.",
    std > 0 && m.inconsistency > POLICY.contradiction * std &&
      `The two-mass numbers contradict a shaft without damping by ${gap} %.`,
    unlooped && "The log has a command, but no controller is simulated: its torque drives the model, and noise that " +
      "goes through the loop biases the result; choose the loop and give the gains of the controller.",
  ].filter(Boolean);
  const list = `<ul class="doubts">${all.map(s => `<li>${s}</li>`).join("")}</ul>`;
  return (a.falsified || a.undecided ? "" : "<p>The data do not contradict this model.</p>") + (all.length ? list : "");
}

function finished(found, record, loop, controller) {
  const r = found.result, error = record.velocity.map((w, i) => w - found.velocity[i]);
  result = {made_by: `gaident ${VERSION}, the page docs/try`, source, loop, controller, ...r};
  window.gaidentResult = result;
  const mass = {"1,0": "one mass", "1,2": "two masses on a shaft"}[`${r.p},${r.q}`] || "no mechanism of one or two masses";
  $("headline").textContent =
      `${mass[0].toUpperCase()}${mass.slice(1)}: structure (${r.p},${r.q}), fit ${r.fitPercent.toFixed(2)} %`;
  $("doubts").innerHTML = doubts(r, loop === "open" && record.command !== null);
  const fit = [
    ["Fit", `${r.fitPercent.toFixed(2)} %`, "1 − rms of the error / deviation of the velocity"],
    ["Error, rms", rounded(r.rmse), "rad/s"],
    ["Noise of the velocity", rounded(r.rmse / r.adequacy.excess), "rad/s, by its third differences"],
    ["Samples", String(r.samples), `every ${rounded(1000 * r.dt)} ms`],
    ["Time", `${r.seconds.toFixed(1)} s`, "in one thread of this browser"]
  ];
  $("mechanics").innerHTML =
      r.mechanics ? rows(mechanicsRows(r.mechanics)) : rows([["—", "This structure is no one-mass or two-mass mechanism.", ""]]);
  $("roots").innerHTML = rows([
    ["Gain K", within(r.gain, r.gainStd), r.p === 1 ? "1/(kg m²)" : `(rad/s)<sup>${r.p - 1}</sup>/(kg m²)`],
    ...r.roots.map(rootRow)
  ]);
  $("fit").innerHTML = rows(fit);
  $("structures").innerHTML = rows(r.structures.map(s => [`(${s.p},${s.q})`, rounded(s.bic, 5), rounded(s.errorSum)]));
  const both = [{values: record.velocity, name: "measured", kind: "measured"},
    {values: found.velocity, name: "simulated", kind: "simulated"}];
  $("charts").innerHTML = chart("Velocity", "rad/s", r.dt, both) +
      chart("Error: measured minus simulated", "rad/s", r.dt, [{values: error, name: "", kind: "error"}]);
  $("result").hidden = false;
  say("");
}

function download() {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([JSON.stringify(result, null, 2)], {type: "application/json"}));
  link.download = "identification.json";
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}

for (const [kind, {units}] of Object.entries(KINDS))
  $(`${kind}-unit`).innerHTML = Object.keys(units).map(unit => `<option>${unit}</option>`).join("");
$("file").onchange = event => event.target.files[0] && take(event.target.files[0]);
$("example").onclick = example;
$("run").onclick = run;
$("cancel").onclick = () => {
  stop();
  say("Cancelled.");
};
$("download").onclick = download;
$("loop").onchange = $("time-column").onchange = changed;
for (const name of ["dragover", "drop"]) document.addEventListener(name, event => event.preventDefault());
document.addEventListener("dragover", () => $("drop").classList.add("over"));
for (const name of ["drop", "dragleave"]) document.addEventListener(name, () => $("drop").classList.remove("over"));
document.addEventListener("drop", event => event.dataTransfer.files[0] && take(event.dataTransfer.files[0]));
