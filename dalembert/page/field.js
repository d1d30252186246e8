// A machine's sheet: readings are typed, corrections, trim, the vibration that is expected and the split on places follow.
const solveTape = new Tape(tapes.solve);
const splitTape = new Tape(tapes.split);
const word = sheet.word;
const amplitudeUnit = sheet.amplitude.unit;
const vibrationHeads = ["", `${TEXTS.amplitude}, ${amplitudeUnit}`, `${TEXTS.phase}, deg`];
const vectorHeads = ["", `${TEXTS[word]}, ${sheet.mass.unit}`, `${TEXTS.angle}, deg`];
const reading = (k, s, what) => `${sheet.runs[k]}/${sheet.sensors[s]}/${what}`;
const onRotor = (k, p, what) => `${sheet.runs[k]}/${sheet.planes[p]}/${what}`;
const has = (name) => Number.isFinite(values[name] ?? NaN);
let doubts = [];
let idle = []; // planes that need no trim, and why
let beyond = []; // planes whose mass is beyond its limit
const amount = (x) => `${short(Number((x / sheet.mass.si).toPrecision(4)))} ${sheet.mass.unit}`;
const settable = sheet.runs.flatMap((_, k) => [
  ...sheet.sensors.flatMap((_s, s) => [reading(k, s, "amplitude"), reading(k, s, "phase")]),
  ...(k ? sheet.planes.flatMap((_p, p) => [onRotor(k, p, word), onRotor(k, p, "angle")]) : []),
]);

function enter(last) {
  const entering = {};
  for (let k = 0; k < sheet.runs.length; k++) {
    for (let s = 0; s < sheet.sensors.length; s++) {
      const there = k <= last && has(reading(k, s, "amplitude")) && has(reading(k, s, "phase"));
      // as the program takes them: the initial run tells the initial vibration, later ones where it was not read
      entering[`run ${k} there ${s}`] = there && (k === 0 || !has(reading(0, s, "amplitude"))) ? 1 : 0;
      entering[`run ${k} read ${s}`] = there ? 1 : 0;
      entering[`run ${k} amplitude ${s}`] = there ? values[reading(k, s, "amplitude")] : 0;
      entering[`run ${k} phase ${s}`] = there ? (sheet.against ? -1 : 1) * values[reading(k, s, "phase")] : 0;
    }
    for (let p = 0; k && p < sheet.planes.length; p++) {
      entering[`run ${k} mass ${p}`] = standing[k]?.[p][0] ?? 0;
      entering[`run ${k} angle ${p}`] = standing[k]?.[p][1] ?? 0;
    }
  }
  return entering;
}
let standing = [];
// a reading is an amplitude with its phase, a mass stands at an angle: what is missing of them in a run
const missingHalves = (k) => [
  ...sheet.sensors.map((sensor, s) => [sensor, reading(k, s, "amplitude"), TEXTS.amplitude, reading(k, s, "phase"), TEXTS.phase]),
  ...(k ? sheet.planes.map((plane, p) => [plane, onRotor(k, p, word), TEXTS[word], onRotor(k, p, "angle"), TEXTS.angle]) : []),
].filter(([, size, , angle]) => has(size) !== has(angle)).map(([of, size, sizeWord, , angleWord]) => TEXTS.half(sheet.runs[k], of, has(size) ? angleWord : sizeWord));
const halved = () => sheet.runs.some((_, k) => missingHalves(k).length);
const readIn = (k) => sheet.sensors.some((_, s) => has(reading(k, s, "amplitude")) || has(reading(k, s, "phase")));

const usedIn = (k) => readIn(k) || [...wrong.keys()].some((name) => name.startsWith(`${sheet.runs[k]}/`)) || (k > 0 && sheet.planes.some((_, p) => has(onRotor(k, p, word)) || has(onRotor(k, p, "angle"))));

solveSheet = () => {
  [doubts, idle, beyond, standing] = [[], [], [], []];
  if (halved()) return;
  let out = null;
  let last = 0;
  for (let k = 0; k < sheet.runs.length; k++) {
    if (k && !readIn(k)) continue;
    if (k) {
      // what stands on the rotor: as typed, else what was advised before
      standing[k] = sheet.planes.map((_, p) => {
        const own = [onRotor(k, p, word), onRotor(k, p, "angle")];
        return own.every(has) ? own.map((name) => values[name]) : out ? [out.get(`plane ${p} size`)[0], out.get(`plane ${p} angle`)[0]] : [0, 0];
      });
    }
    last = k;
    const entering = enter(k);
    out = solved(solveTape, sheet.outputs, entering, entering);
  }
  if (!out) return;
  const angle = (name) => turned(out.get(name));
  const phase = (name) => turned(out.get(name), sheet.against ? -1 : 1);
  sheet.planes.forEach((plane, p) => {
    answers.set(`${plane}.${word}`, out.get(`plane ${p} size`));
    answers.set(`${plane}.angle`, angle(`plane ${p} angle`));
    const trim = last ? `trim ${last} ${p}` : `plane ${p}`;
    answers.set(`trim.${plane}.${word}`, out.get(`${trim} size`));
    answers.set(`trim.${plane}.angle`, angle(`${trim} angle`));
    if (last && sheet.sensors.every((_, s) => has(reading(last, s, "amplitude")))) {
      answers.set(`fresh.${plane}.${word}`, out.get(`fresh ${last} ${p} size`));
      answers.set(`fresh.${plane}.angle`, angle(`fresh ${last} ${p} angle`));
    }
    if (sheet.errors) {
      for (const [lead, from, size] of [["", p, `plane ${p} size`], ["trim.", last ? `${last} ${p}` : p, `${trim} size`]]) {
        answers.set(`${lead}${plane}.${word}_uncertainty`, out.get(`along ${from}`));
        answers.set(`${lead}${plane}.angle_uncertainty`, [out.get(`across ${from}`)[0] / out.get(size)[0], 0]);
      }
    }
    // as the program decides: a plane needs no trim where every requested limit is met
    const stands = sheet.sensors.map((_, s) => out.get(`${has(reading(last, s, "amplitude")) ? "read" : "expected"} ${last} ${s}`)[0]);
    const limits = [];
    if (sheet.ceiling !== null) limits.push([stands.every((x) => x <= sheet.ceiling * (1 + 1e-9)), TEXTS.vibrationWithin]);
    if (sheet.permissible) limits.push([sheet.permissible[p] !== null && out.get(`left ${last} ${p}`)[0] <= sheet.permissible[p], TEXTS.unbalanceWithin]);
    if (nothing(plane) && !last) idle.push(TEXTS.idle(plane, TEXTS.nothingLeft));
    else if (sheet.errors && answer(`trim.${plane}.${word}`) < answer(`trim.${plane}.${word}_uncertainty`)) idle.push(TEXTS.idle(plane, TEXTS.belowUncertainty));
    else if (limits.length && limits.every(([met]) => met)) idle.push(TEXTS.idle(plane, limits.map(([, why]) => why).join(TEXTS.and)));
    if (sheet.limits[p] !== null && answer(`${plane}.${word}`) > sheet.limits[p] * (1 + 1e-12)) beyond.push(TEXTS.beyondLimit(plane, amount(answer(`${plane}.${word}`)), amount(sheet.limits[p])));
  });
  sheet.sensors.forEach((sensor, s) => {
    // rounding of nothing is nothing, as in the program
    const left = out.get(`residual ${s} size`);
    answers.set(`residual/${sensor}/amplitude`, left[0] > 1e-12 * out.get(`initial ${s} size`)[0] ? left : [0, 0]);
    answers.set(`residual/${sensor}/phase`, phase(`residual ${s} angle`));
  });
  // a reading that is farther off what the others say than three of its own standard deviations
  if (sheet.errors && last) {
    for (let k = 0; k <= last; k++) {
      for (let s = 0; s < sheet.sensors.length; s++) {
        const a = values[reading(k, s, "amplitude")];
        const limit = 3 * a * Math.hypot(...sheet.errors);
        if (has(reading(k, s, "amplitude")) && out.get(`off ${k} ${s}`)[0] > limit) doubts.push(TEXTS.repeat(sheet.runs[k], sheet.sensors[s]));
      }
    }
  }
  if (sheet.places) sheet.planes.forEach(splitOn);
};
// whether no digit of a trim holds
const nothing = (plane) => !Number(shownAnswer(`trim.${plane}.${word}`, sheet.mass.si));
// a trim on the two places on either side of it, or where these do not reach it on the nearer one
function splitOn(plane) {
  const [size, angle] = [answer(`trim.${plane}.${word}`), answer(`trim.${plane}.angle`)];
  if (nothing(plane)) return;
  const k = sheet.places.findLastIndex(([, place]) => place <= angle);
  const pair = [sheet.places.at(k), sheet.places.at((k + 1) % sheet.places.length)];
  const [low, high] = pair.map(([, place]) => place);
  const [first, second, nearFirst, offFirst, nearSecond, offSecond] = splitTape.one({ size, angle, first: low, second: high });
  let shares = [first, second];
  const gap = whole(high - low) || 2 * Math.PI;
  if (sheet.places.length < 2 || gap > Math.PI - 1e-9) {
    const [near] = [[0, nearFirst, offFirst], [1, nearSecond, offSecond]].filter(([, mass]) => mass > 0).sort((one, other) => one[2] - other[2]);
    shares = [0, 1].map((i) => (near?.[0] === i ? near[1] : 0));
    const off = near ? near[2] : size;
    if (off > 1e-9 * size) beyond.push(TEXTS.outOfReach(plane, amount(off)));
  }
  shares.forEach((share, i) => {
    answers.set(`split.${plane}.${i + 1}.${word}`, [share, 0]);
    answers.set(`split.${plane}.${i + 1}.angle`, [pair[i][1], 0]);
  });
  placeNames.set(plane, pair.map(([name]) => name));
}
const placeNames = new Map(); // plane -> the names of its two places

const boxes = []; // of each run
const missingLines = []; // below its fields: what is missing of them
function build() {
  $("entries").querySelectorAll("fieldset, .scroll").forEach((one) => one.remove());
  inputs.clear();
  for (const [k, run] of sheet.runs.entries()) {
    const box = put($("entries"), "fieldset");
    boxes[k] = box;
    put(box, "legend", {}, run);
    const readings = grid(box, "", vibrationHeads, { class: "cells" });
    sheet.sensors.forEach((sensor, s) => {
      const line = readings.row(sensor);
      cell(put(line, "td"), reading(k, s, "amplitude"), "amplitude", amplitudeUnit, { positive: true, empty: k > 0 });
      cell(put(line, "td"), reading(k, s, "phase"), "angle", "deg", { empty: k > 0 });
    });
    if (k) {
      put(box, "p", { class: "soft" }, TEXTS.standing);
      const masses = grid(box, "", vectorHeads, { class: "cells" });
      sheet.planes.forEach((plane, p) => {
        const line = masses.row(plane);
        cell(put(line, "td"), onRotor(k, p, word), sheet.mass.kind, sheet.mass.unit, { positive: true, empty: true });
        cell(put(line, "td"), onRotor(k, p, "angle"), "angle", "deg", { empty: true });
      });
    }
    missingLines[k] = put(box, "p", { class: "doubt", role: "status" });
  }
  update();
}
const R = 70; // of a dial
function dial(parent, plane) {
  const host = put(parent, "figure");
  put(host, "figcaption", {}, TEXTS.dial(plane));
  const picture = put(host, "svg", { role: "img", "aria-label": TEXTS.dial(plane), viewBox: "-30 0 360 260", class: "polygon dialled" });
  put(picture, "circle", { class: "dial", cx: 150, cy: 130, r: R });
  const at = (angle, r) => [(150 + r * Math.cos(angle)).toFixed(1), (130 - r * Math.sin(angle)).toFixed(1)];
  for (const [, place] of sheet.places ?? []) {
    const [x, y] = at(place, R);
    put(picture, "circle", { class: "place", cx: x, cy: y, r: 4 });
  }
  const marks = (sheet.places ? [`split.${plane}.1`, `split.${plane}.2`] : [`trim.${plane}`]).map((name, i) => [answer(`${name}.angle`), answer(`${name}.${word}`), placeNames.get(plane)?.[i]]).filter(([angle, size]) => Number.isFinite(angle) && size > 0 && !nothing(plane));
  // the words of two marks that are close stand farther apart
  const between = marks.length < 2 ? 0 : Math.atan2(Math.sin(marks[1][0] - marks[0][0]), Math.cos(marks[1][0] - marks[0][0]));
  const apart = between ? (Math.sign(between) * Math.max(0, 0.7 - Math.abs(between))) / 2 : 0;
  for (const [k, [angle, size, name]] of marks.entries()) {
    const [x, y] = at(angle, R);
    put(picture, "circle", { class: "place on", cx: x, cy: y, r: 7 });
    const words = angle + (k ? apart : -apart);
    const [u, v] = at(words, R + 13);
    const side = Math.abs(Math.cos(words)) < 0.3 ? "" : Math.cos(words) > 0 ? "start" : "end";
    const lines = [...(name ? [TEXTS.place(name)] : []), amount(size), `${Number(((angle * 180) / Math.PI).toFixed(1))}°`];
    const y0 = Number(v) - 7 * lines.length * Math.sin(words);
    lines.forEach((text, i) => put(picture, "text", { x: u, y: y0 + 14 * (i - (lines.length - 1) / 2), class: side }, text));
  }
  put(picture, "text", { x: 150, y: 130 }, "0° →");
}
drawSheet = () => {
  keep();
  const host = $("answers");
  host.replaceChildren();
  // one run more than was read: the answers stay near
  const last = boxes.findLastIndex((_, k) => usedIn(k));
  for (const [k, box] of boxes.entries()) {
    box.classList.toggle("unused", k > 0 && !usedIn(k));
    box.hidden = k > last + 1;
    missingLines[k].textContent = missingHalves(k).join(" ");
  }
  const turn = Math.PI / 180;
  for (const text of beyond) put(host, "p", { class: "doubt", role: "status" }, text);
  for (const text of idle) put(host, "p", { role: "status" }, text);
  // as many digits as the standard deviation leaves: two of its own
  const sure = (name, by, plain) => {
    const [x, error] = [answer(name) / by, answer(`${name}_uncertainty`) / by];
    if (!sheet.errors || !Number.isFinite(x) || !(error > 0)) return plain;
    const places = Math.min(15, Math.max(0, 1 - Math.floor(Math.log10(error))));
    return `${x.toFixed(places)} ± ${error.toFixed(places)}`;
  };
  const vectors = (lead) => sheet.planes.map((plane) => {
    const [size, angle] = shownVector(`${lead}${plane}.`, word, sheet.mass.si, "angle");
    return [plane, sure(`${lead}${plane}.${word}`, sheet.mass.si, size), angle === "–" ? angle : sure(`${lead}${plane}.angle`, turn, angle)];
  });
  answerTable(host, TEXTS.corrections, vectorHeads, vectors(""));
  answerTable(host, TEXTS.trim, vectorHeads, vectors("trim."));
  if (sheet.planes.some((plane) => answers.has(`fresh.${plane}.${word}`))) answerTable(host, TEXTS.fresh, vectorHeads, vectors("fresh."));
  if (doubts.length) put(host, "p", { class: "doubt", role: "status" }, doubts.join(" "));
  answerTable(host, TEXTS.expected, vibrationHeads, sheet.sensors.map((sensor) => [sensor, ...shownVector(`residual/${sensor}/`, "amplitude", 1, "phase")]));
  const drawn = put(host, "div", { class: "polygons" });
  if (answers.size) for (const plane of sheet.planes) dial(drawn, plane);
  const box = put(host, "details");
  put(box, "summary", {}, TEXTS.coefficients);
  answerTable(box, TEXTS.coefficients, [TEXTS.sensor, TEXTS.plane, TEXTS.per(amplitudeUnit, sheet.mass.unit), `${TEXTS.phase}, deg`], sheet.coefficients.map(([sensor, plane, size, angle, along, across]) => {
    const error = (x) => (Number.isFinite(x) ? ` ± ${Number(x.toPrecision(2))}` : "");
    return [sensor, plane, short(size * sheet.mass.si) + error(along * sheet.mass.si), short(sheet.against ? (360 - angle) % 360 : angle) + error(across / turn)];
  }));
  const limits = sheet.planes.flatMap((plane, p) => (sheet.limits[p] === null ? [] : [[`${TEXTS.largest} ${plane}`, amount(sheet.limits[p])]]));
  if (sheet.permissible) limits.push(...sheet.planes.map((plane, p) => [TEXTS.permissibleIn(plane), sheet.permissible[p] === null ? "–" : amount(sheet.permissible[p])]));
  const facts = [...sheet.facts, ...(sheet.ceiling === null ? [] : [[TEXTS.largestVibration, `${short(sheet.ceiling)} ${amplitudeUnit}`]]), ...limits];
  if (!facts.length) return;
  put(host, "h2", {}, TEXTS.machine);
  for (const [name, text] of facts) put(host, "p", { class: "soft" }, `${name}: ${text}`);
};

function csv() {
  // a half of a reading or of a mass is no row
  if (wrong.size || halved()) return "";
  const speeds = sheet.channels.some(([, speed]) => speed !== null);
  const lines = [["run", "sensor", ...(speeds ? [`speed_${sheet.speedUnit}`] : []), `amplitude_${sheet.amplitude.header}`, "phase_deg", "trial_plane", `trial_${word}_${sheet.mass.header}`, "trial_angle_deg"].join(",")];
  for (const [k, run] of sheet.runs.entries()) {
    if (!readIn(k)) continue;
    const on = k ? (standing[k] ?? sheet.planes.map(() => [0, 0])) : null;
    for (const [s, [sensor, speed]] of sheet.channels.entries()) {
      if (!has(reading(k, s, "amplitude"))) continue;
      const masses = on ? [quoted(sheet.planes.join(";")), on.map(([size]) => inUnit(size, sheet.mass.unit)).join(";"), on.map(([, angle]) => inUnit(whole(angle), "deg")).join(";")] : ["", "", ""];
      lines.push([quoted(run), quoted(sensor), ...(speeds ? [String(speed ?? "")] : []), String(values[reading(k, s, "amplitude")]), inUnit(values[reading(k, s, "phase")], "deg"), ...masses].join(","));
    }
  }
  return `${lines.join("\n")}\n`;
}

// notes of the machine, kept with the readings
const notes = make("textarea", { id: "notes", rows: "3", "aria-label": TEXTS.notes, placeholder: TEXTS.notes });
notes.addEventListener("input", keep);
notes.addEventListener("keydown", (event) => event.stopPropagation());
$("entries").append(notes);

// what was typed is kept on this machine, where the browser allows it
const kept = `dalembert ${sheet.id}`;
function keep() {
  try {
    if (!wrong.size) localStorage.setItem(kept, JSON.stringify([...Object.entries(values).filter(([, x]) => Number.isFinite(x)), ["", notes.value]]));
  } catch {
    // a page in a frame keeps nothing
  }
}
try {
  const before = localStorage.getItem(kept);
  if (before) for (const [name, x] of JSON.parse(before)) if (name === "" && typeof x === "string") notes.value = x;
  else if (settable.includes(name) && typeof x === "number") values[name] = x;
} catch {
  // nothing was kept
}

window.dalembert = {
  names: settable,
  set(changed) {
    const unknown = Object.keys(changed).find((name) => !settable.includes(name));
    if (unknown !== undefined) {
      say(TEXTS.unknown(unknown));
      return false;
    }
    asOne(() => Object.entries(changed).forEach(([name, x]) => check(name, x, Number.isNaN(x) ? "" : String(x), inputs.get(name).rules)));
    update();
    return answers.size > 0;
  },
  get: (name) => (settable.includes(name) ? (wrong.has(name) ? NaN : (values[name] ?? NaN)) : answer(name)),
  curve: () => [],
  options: () => "",
  toml: () => "",
  csv,
};
start();
