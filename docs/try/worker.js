"use strict";
// In the web worker: takes {record, loop, controller, seed}, or {example: true}, and answers {progress}, {record} of the
// example, {done} or {wrong}.

// The page's own record: a two-mass drive under the torque of a digital PI controller, with noise on its velocity.
function exampleOf(module) {
  const n = 1500, dt = 1e-3, drive = EXAMPLE.drive, controller = EXAMPLE.controller, command = [];
  for (let k = 0; k < n; k++) command.push([0, 30, 30, 60, 60, 10, -20, -20, 25, 0][Math.floor(k / 150)]);
  const session = new Session(module, {input: command, velocity: command, dt}, "sampled", controller, false);
  const {velocity, torque} = session.simulate(session.fit(drive, [], 0, 1e-9));
  session.close();
  let state = 1;
  const uniform = () =>
      (state = (state * 48271) % 2147483647) / 2147483647;  // of the kind of Lehmer: the same numbers everywhere
  const normal = () => {
    let sum = -6;
    for (let k = 0; k < 12; k++) sum += uniform();
    return sum;
  };
  return {dt, command, torque: Array.from(torque), velocity: Array.from(velocity, w => w + EXAMPLE.noise * normal())};
}

async function serve({record, loop, controller, seed, example}, answer) {
  try {
    const module = await gaidentCore({progress: (done, best, species, p, q) => answer({progress: {done, best, species, p, q}})});
    if (example) return answer({record: exampleOf(module)});
    const began = Date.now(), found = identify(module, record, loop, controller, seed, stage => answer({progress: {stage}}));
    found.result.seconds = (Date.now() - began) / 1000;
    answer({done: found});
  } catch (wrong) {
    answer({wrong: wrong instanceof DataError ? wrong.message : `The core says: ${wrong.message || wrong}`});
  }
}

if (typeof self !== "undefined" && typeof postMessage === "function")
  self.onmessage = event => serve(event.data, answer => postMessage(answer));
