// A sheet of numbers that are typed and answers that follow: cells by name, undo, reset, what is handed over.
const sheet = data.sheet;
let values = { ...sheet.values }; // SI and radians, amplitudes as the file has them; NaN where a cell is empty
const own = { ...sheet.values };
let answers = new Map(); // name -> [number, how far a second computation with 32 digits is from it]
let solveSheet, drawSheet; // of the kind of sheet
let refusedRows = () => []; // likewise: what rows lack that the program would refuse
const inputs = new Map(); // name -> {input, unit, into, rules, kind}

const snapshot = () => structuredClone({ values, rows: sheet.rows });
const restore = (before) => ([values, sheet.rows] = [before.values, before.rows]);
const anew = () => build();
// a cell of a table: what was typed is checked at once, and a wrong one leaves no answer standing
function cell(parent, name, kind, unit, rules = {}) {
  // an amplitude stays in the file's unit
  const into = kind === "amplitude" ? unit : undefined;
  const input = numberField(parent, name, { unit, into }, !rules.positive && kind !== "angle", (x, text) => {
    const empty = text.trim() === "";
    check(name, empty && rules.empty ? NaN : x, text, rules);
    update();
  });
  input.addEventListener("blur", listCells);
  inputs.set(name, { input, unit, into, rules });
  return input;
}
function check(name, x, text, rules) {
  const of = inputs.get(name);
  const empty = Number.isNaN(x) && rules.empty && text.trim() === "";
  const why = empty ? "" : refusal(name, x, text, `10 ${of.unit}`, rules.positive);
  if (why) {
    wrong.set(name, why);
    return;
  }
  const slack = rules.within ? 1e-9 * (rules.within[1] - rules.within[0]) : 0;
  if (rules.within && (x < rules.within[0] - slack || x > rules.within[1] + slack)) {
    const [low, high] = rules.within.map((end) => shortest(end, of.unit));
    wrong.set(name, TEXTS.outside(name, text, low, `${high} ${of.unit}`));
    return;
  }
  if (!wrong.delete(name) || !Object.is(values[name], x)) remember();
  values[name] = x;
}
function listCells() {
  for (const [name, field] of inputs) {
    if (refreshed(field, name, values[name] ?? NaN)) field.input.classList.toggle("changed", !Object.is(values[name], own[name]));
  }
  listUndo();
}
function update() {
  answers = new Map();
  copied("");
  const refused = wrong.size ? [...wrong.values()] : refusedRows();
  if (!refused.length) solveSheet();
  say(refused.join("; "));
  drawSheet();
  listCells();
}
const answer = (name) => answers.get(name)?.[0] ?? NaN;
// an answer in a unit, with the digits that hold
function shownAnswer(name, by = 1) {
  const [x, error] = answers.get(name) ?? [NaN, 0];
  return Number.isFinite(x) ? short(Number(held(x / by, error / by)) || 0) : "–";
}
// a vector's size and angle; what is nothing has no angle
function shownVector(name, what, by, angle) {
  const size = shownAnswer(`${name}${what}`, by);
  const turn = shownAnswer(`${name}${angle}`, Math.PI / 180);
  return [size, Number(size) ? (turn === "360" ? "0" : turn) : "–"];
}
const whole = (x) => (x < 0 ? (x + 2 * Math.PI < 2 * Math.PI ? x + 2 * Math.PI : 0) : x + 0);
// an angle from 0 to a whole turn, and its error: two computations may differ by a turn
const turned = ([x, error], sense = 1) => [whole(sense * x), Math.min(error, Math.abs(2 * Math.PI - error))];
// the outputs of a tape by their names, with how far 32 digits are from them
function solved(tape, names, entering, twice) {
  const [out, more] = [tape.one(entering), tape.twice(twice)];
  return new Map(names.map((name, k) => [name, [out[k], Math.abs(more[k][0] - out[k] + more[k][1]), more[k]]]));
}
$("entries").append(tools, outbox, alertLine);
tool(TEXTS.reset, () => {
  remember();
  values = { ...own };
  sheet.rows = structuredClone(sheet.first);
  wrong.clear();
  build();
});
tool(TEXTS.copyRows, () => copied(csv()));
tool(TEXTS.saveRows, () => saved(csv(), "text/csv", "csv"));
tool(TEXTS.print, () => print());
const quoted = (text) => (/[",\r\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text);
const inUnit = (x, unit) => shortest(x ?? NaN, unit);

// vectors from one point to the next, and a last one that closes them
function polygon(parent, title, vectors, closing, label) {
  const host = put(parent, "figure");
  put(host, "figcaption", {}, title);
  const svg = put(host, "svg", { role: "img", "aria-label": title, viewBox: "0 0 300 260", class: "polygon" });
  const corners = [[0, 0]];
  for (const [, x, y] of vectors) corners.push([corners.at(-1)[0] + x, corners.at(-1)[1] + y]);
  const all = [...corners, [corners.at(-1)[0] + closing[0], corners.at(-1)[1] + closing[1]]].filter(([x, y]) => Number.isFinite(x + y));
  if (all.length < corners.length + 1) return;
  const [xs, ys] = [range(all.map(([x]) => x)), range(all.map(([, y]) => y))];
  const k = Math.min(240 / (xs[1] - xs[0] || 1e-300), 190 / (ys[1] - ys[0] || 1e-300));
  const at = ([x, y]) => [150 + k * (x - (xs[0] + xs[1]) / 2), 130 - k * (y - (ys[0] + ys[1]) / 2)];
  const words = texts(svg);
  words.begin(300, 260);
  const lines = [[corners.at(-1), all.at(-1), "closing", label], ...vectors.map(([name], i) => [corners[i], corners[i + 1], "share", name])].map(([a, b, ...rest]) => [at(a), at(b), ...rest]);
  for (const [[x, y], [u, v], kind] of lines) {
    put(svg, "path", { class: kind, d: arrow(x, y, u - x, v - y) });
    const steps = Math.ceil(Math.hypot(u - x, v - y) / 6) || 1;
    for (let k = 0; k <= steps; k++) words.take(x + (k / steps) * (u - x), y + (k / steps) * (v - y), 1);
  }
  for (const [[x, y], [u, v], , text] of lines) {
    if (Math.hypot(u - x, v - y) < 12) continue;
    const side = direction([v - y, x - u]);
    const places = [9, 13, 18].flatMap((gap) => [0.5, 0.3, 0.7, 0.15, 0.85].flatMap((share) => [1, -1].map((sense) => {
      const [du, dv] = aside(text, [sense * side[0], sense * side[1]], gap);
      return [x + share * (u - x) + du, y + share * (v - y) + dv];
    })));
    words.set(text, places, "point");
  }
}
function start() {
  theme();
  build();
}
// a table of answers
function answerTable(host, caption, heads, rows) {
  const table = grid(host, caption, heads);
  for (const [name, ...cells] of rows) {
    const line = table.row(name);
    for (const text of cells) put(line, "td", {}, text);
  }
}
