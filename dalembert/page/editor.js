// A mechanism whose dimensions are dragged and typed: handles, fields, undo, options and file to take away. `window.dalembert` is the same for scripts.
const { model } = data;
const main = document.querySelector("main");

// --- what can be set ------------------------------------------------------------------------------------------------------
const inputNames = model.inputs.map((input) => (machine.one ? "input" : input.name));
const unitOf = (kind) => model.units[kind];
const inputKind = (j) => (model.inputs[j].slides ? "length" : "angle");
const kindOf = (name) => (inputNames.includes(name) ? inputKind(inputNames.indexOf(name)) : machine.kinds.get(name));
const shownInput = (j) => (shown < n ? machine.sweep[j][shown] : freePose[j]);
const present = (name) => (inputNames.includes(name) ? shownInput(inputNames.indexOf(name)) : numbers[name]);
const isName = (name) => inputNames.includes(name) || machine.kinds.has(name);

const snapshot = () => [{ ...numbers }, freePose.slice(), shown];
const restore = (before) => ([numbers, freePose, shown] = before);
const anew = () => update();
// put numbers by name, SI and radians; the free pose is shown where an input is among them
function put_(changed) {
  let moved = false;
  for (const [name, x] of Object.entries(changed)) {
    const j = inputNames.indexOf(name);
    if (j < 0) numbers[name] = x;
    else {
      if (!moved && shown < n) freePose = model.inputs.map((_, k) => shownInput(k));
      freePose[j] = x;
      moved = true;
    }
  }
  if (moved) shown = n;
}
function nearestPose() {
  let near = 0;
  for (let i = 1; i < n; i++) if (Math.abs(machine.sweep[0][i] - freePose[0]) < Math.abs(machine.sweep[0][near] - freePose[0])) near = i;
  return near;
}
const digits = new Map(); // "kind number" -> the number in 32 digits
function exactly(x, kind) {
  const key = `${kind} ${x}`;
  if (digits.size > 10000) digits.clear();
  if (!digits.has(key)) digits.set(key, digitsOf(x, unitOf(kind)));
  return digits.get(key);
}
let errors = [null, -1, null]; // state, pose, how far its rows are from 32 digits
function errorAt(column, i) {
  if (!state.rows || "input" in column || "zero" in column) return 0;
  if (errors[0] !== state || errors[1] !== i) errors = [state, i, Number.isFinite(state.closed[i]) ? machine.errors(state, i, exactly) : null];
  const rows = errors[2];
  if (!rows) return NaN;
  return (rows[column.row] + (column.less === undefined ? 0 : rows[column.less])) / (column.si ?? 1);
}
function fillHeld(cell, k, i, every) {
  let x = k === null ? NaN : whole.columns[k].values[i];
  // a number in another unit than SI is rounded once more
  const once = k !== null && (whole.columns[k].si ?? 1) !== 1 ? Math.abs(x) * Number.EPSILON : 0;
  const error = k === null ? 0 : errorAt(whole.columns[k], i) + once;
  // of what is interpolated beside a change point there is no second computation
  if (Number.isNaN(error)) {
    const { turns, si = 1 } = whole.columns[k];
    const rest = turns ? x - (TAU / si) * Math.round((x * si) / TAU) : x;
    if (Math.abs(rest) < noiseOf(whole.columns[k])) x = 0;
  }
  if (k === null) cell.textContent = "";
  else if (!every) cell.textContent = short(Number(held(x, error) === "–" ? NaN : held(x, error)));
  else if (error === 0) fill(cell, exact(x));
  else fill(cell, held(x, error));
}

// --- all anew -------------------------------------------------------------------------------------------------------------
let due = 0;
function update() {
  cancelAnimationFrame(due);
  due = 0;
  // those of the earlier numbers
  $("limits").textContent = "";
  recompute(whole);
  sizeCircles();
  if (shown === n && n > 1) $("slider").value = nearestPose();
  // with the fields, and with what is to be said
  refresh();
  clearTimeout(waiting);
  waiting = setTimeout(listLimits, 150);
}
function soon() {
  if (!due) due = requestAnimationFrame(update);
}
const textOf = (x, kind) => `${shortest(x, unitOf(kind))} ${unitOf(kind)}`;
function whyNot() {
  if (wrong.size) return "";
  if (!state.chosen) return state.fixed?.open ? TEXTS.openAtGuess(state.fixed.open) : TEXTS.impossible;
  if (Number.isFinite(state.closed[shown])) return "";
  const gap = machine.short(state, shown);
  return gap && Number.isFinite(gap[1]) ? TEXTS.short(gap[0], `${Number(Number(shortest(gap[1], unitOf("length"))).toPrecision(3))} ${unitOf("length")}`) : TEXTS.open;
}
function tell(text = "") {
  say(text || [...wrong.values()].join("; ") || whyNot());
}
let waiting = 0;
function listLimits() {
  // where it stands nowhere there is nothing to say of limits
  const stands = !wrong.size && state.chosen && state.closed.some(Number.isFinite);
  const limits = stands ? machine.limits(numbers).map(([q]) => q) : [];
  const unit = unitOf(inputKind(0));
  // two loops may end at one input
  const shownLimits = [...new Set(limits.map((q) => `${short(Number(shortest(q, unit)))} ${unit}`))];
  const none = model.inputs[0].slides ? TEXTS.noLimitsOfSlide : TEXTS.noLimits;
  $("limits").textContent = !machine.one || !stands ? "" : limits.length ? TEXTS.limits(shownLimits.join(", ")) : none;
}

// --- buttons --------------------------------------------------------------------------------------------------------------
$("toggles").before(alertLine);
$("legend").after(tools);
tool(TEXTS.reset, () => {
  remember();
  [numbers, freePose] = [{ ...machine.own }, model.first.slice()];
  wrong.clear();
  update();
  fit();
  show(shown);
});
tool(TEXTS.fitDrawing, () => {
  fit();
  show(shown);
});
const file = () => toml() || (wrong.size ? "" : TEXTS.noFile);
tool(TEXTS.copyOptions, () => copied(options()));
tool(TEXTS.copyFile, () => copied(file()));
tool(TEXTS.saveFile, () => (model.toml ? saved(toml(), "application/toml", "toml") : say(TEXTS.noFile)));
tools.after(outbox);
outbox.after(make("p", { id: "limits" }));

// --- options and file to take away --------------------------------------------------------------------------------------------
const quoted = (text) => (/^[\w@%+=:,./-]+$/.test(text) ? text : `'${text.replaceAll("'", "'\\''")}'`);
function optionText(name, x) {
  const kind = kindOf(name);
  if (kind === "length") return `${shortest(x, "m")}m`;
  if (kind === "angle") return `${shortest(x, "deg")}deg`;
  return String(x);
}
function options() {
  if (wrong.size) return "";
  const sets = changes().map((path) => `--set ${quoted(`${path}=${optionText(path, numbers[path])}`)}`);
  const at = inputNames.map((name, j) => (machine.one ? "" : `${name}=`) + optionText(name, shownInput(j)));
  return [...sets, `--at ${quoted(at.join(","))}`].join(" ");
}
function toml() {
  if (!model.toml || wrong.size) return "";
  const lines = model.toml.filter(({ of, needed }) => needed || of.some((piece) => Array.isArray(piece) && numbers[piece[0]] !== machine.own[piece[0]]));
  const note = model.files.length ? `# ${TEXTS.needs(model.files.join(", "))}\n` : "";
  return `${note}${lines.map(({ of }) => of.map((piece) => (Array.isArray(piece) ? tomlNumber(numbers[piece[0]]) : piece)).join("")).join("\n")}\n`;
}
const tomlNumber = (x) => (Number.isInteger(x) ? `${x + 0}.0` : String(x).replace(/^(-?\d+)e/, "$1.0e"));

// --- fields ---------------------------------------------------------------------------------------------------------------
const fields = new Map();
const panel = make("section", { id: "numbers" });
main.append(panel);
put(panel, "h2", {}, TEXTS.numbers);
put(panel, "p", { class: "soft" }, `${TEXTS.howTo} ${TEXTS.digits}`);
const positive = new Set(["mass", "inertia"]);
function change(name, x, text) {
  const kind = kindOf(name);
  const why = refusal(name, x, text, textOf(present(name), kind), positive.has(kind));
  if (why) wrong.set(name, why);
  else {
    if (!wrong.delete(name) || !Object.is(present(name), x)) remember();
    put_({ [name]: x });
  }
  update();
}
function numberRow(body, name) {
  const kind = kindOf(name);
  const unit = unitOf(kind);
  const line = put(body, "div", { class: "number" });
  breaking(put(line, "label"), name);
  const input = numberField(line, name, { unit }, !positive.has(kind), (x, text) => change(name, x, text));
  input.addEventListener("blur", listFields);
  breaking(put(line, "span", { class: "soft" }), unit);
  const range = put(line, "input", { type: "range", min: "0", max: "400", step: "1", "aria-label": TEXTS.slider(name) });
  // from half to one and a half of the first number; of what is zero some part of the size
  const first = present(name);
  const span = kind === "angle" && inputNames.includes(name) ? Math.PI : Math.abs(first) / 2 || (kind === "length" ? model.size / 4 : kind === "angle" ? 0.5 : 1);
  const low = positive.has(kind) && !first ? 0 : first - span;
  range.addEventListener("input", () => {
    if (!range.dataset.held) remember();
    range.dataset.held = "1";
    wrong.delete(name);
    put_({ [name]: Number((low + (2 * span * Number(range.value)) / 400).toPrecision(6)) });
    soon();
  });
  range.addEventListener("change", () => delete range.dataset.held);
  range.addEventListener("keydown", (event) => event.stopPropagation());
  fields.set(name, { input, range, unit, place: (x) => Math.round((400 * (x - low)) / (2 * span)) });
}
function listFields() {
  for (const [name, field] of fields) {
    if (!refreshed(field, name, present(name))) continue;
    field.range.value = field.place(present(name));
    field.input.parentNode.classList.toggle("changed", machine.kinds.has(name) && !Object.is(numbers[name], machine.own[name]));
  }
  listUndo();
}
const groupsOf = new Map([[TEXTS.inputs, [...inputNames]]]);
for (const path of machine.kinds.keys()) {
  const parts = path.split(".");
  const head = parts[0] === "links" ? parts.slice(0, 2).join(".") : parts[0];
  groupsOf.set(head, [...(groupsOf.get(head) ?? []), path]);
}
for (const [head, names] of groupsOf) {
  const box = put(panel, "details", head === TEXTS.inputs || names.length < 7 ? { open: "" } : {});
  put(box, "summary", {}, head);
  for (const name of names) numberRow(box, name);
}

// --- handles ----------------------------------------------------------------------------------------------------------------
svg.setAttribute("role", "group"); // what is in an image is hidden from screen readers
const handleLayer = put(svg, "g", { id: "handles" });
const bodyIndex = (name) => whole.bodies.findIndex((b) => b.name === name);
function local(path, body, point, origin) {
  if (origin === null) return [numbers[`${path}.x`], numbers[`${path}.y`]];
  const [x, y] = localOf(body, origin);
  const [length, angle] = [numbers[`${path}.length`], numbers[`${path}.angle`]];
  return [x + length * Math.cos(angle), y + length * Math.sin(angle)];
}
function localOf(body, point) {
  return local(...model.handles.find(([, b, p]) => b === body && p === point));
}
let lastStands = null;
const handleParts = model.handles.map((handle) => {
  const [path, body] = handle;
  const group = put(handleLayer, "g", { class: `handle ${classOf(bodyIndex(body))}`, tabindex: "0", role: "button", "data-name": path, "aria-label": TEXTS.handle(path), display: "none" });
  put(group, "circle", { class: "grip", r: 16 });
  put(group, "circle", { class: "knob", r: 5 });
  put(group, "title", {}, path);
  const move = (x, y) => {
    // a place in the picture in the axes of the body, with the digits of a pixel
    const [ox, oy, c, s] = lastStands[bodyIndex(body)];
    const [dx, dy] = [x - ox, y - oy];
    const digit = 10 ** Math.floor(Math.log10(0.5 / scale));
    const round = (value) => Number((Math.round(value / digit) * digit).toPrecision(12));
    const [u, v] = [c * dx + s * dy, c * dy - s * dx];
    if (handle[3] === null) put_({ [`${path}.x`]: round(u), [`${path}.y`]: round(v) });
    else {
      const [a, b] = localOf(body, handle[3]);
      put_({ [`${path}.length`]: round(Math.hypot(u - a, v - b)), [`${path}.angle`]: Number(Math.atan2(v - b, u - a).toPrecision(6)) });
    }
    soon();
  };
  const place = () => carried(lastStands[bodyIndex(body)], ...local(...handle));
  let grip = null;
  let moved = false;
  group.addEventListener("pointerdown", (event) => {
    if (!lastStands) return;
    group.setPointerCapture(event.pointerId);
    play(false);
    const [x, y] = place();
    grip = [px(x) - event.clientX, py(y) - event.clientY];
    moved = false;
    event.preventDefault();
    group.focus({ preventScroll: true });
  });
  // a finger on a handle never scrolls the page, though the drawing around it does
  group.addEventListener("touchstart", (event) => event.preventDefault(), { passive: false });
  group.addEventListener("pointermove", (event) => {
    if (!grip) return;
    // a touch alone changes nothing
    if (!moved) remember();
    moved = true;
    const [u, v] = [event.clientX + grip[0], event.clientY + grip[1]];
    move((left + right) / 2 + (u - width / 2) / scale, (low + high) / 2 - (v - height / 2) / scale);
  });
  for (const end of ["pointerup", "pointercancel"]) group.addEventListener(end, () => (grip = null));
  group.addEventListener("keydown", (event) => {
    const way = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
    if (!way || !lastStands) return;
    event.preventDefault();
    event.stopPropagation();
    remember();
    const step = 10 ** Math.floor(Math.log10(model.size / 50)) * (event.shiftKey ? 10 : 1);
    const [x, y] = place();
    move(x + way[0] * step, y + way[1] * step);
    update();
  });
  return { handle, group, place };
});
let gripped = true;
drawHandles = (stands) => {
  if (stands) lastStands = stands;
  if (!lastStands) return;
  for (const { handle, group, place } of handleParts) {
    const body = bodyIndex(handle[1]);
    let [u, v] = (([x, y]) => [px(x), py(y)])(place());
    // next to a joint, towards the middle of the link: each link's own point can be taken
    const others = model.handles.filter(([, b]) => b === handle[1]).map((one) => carried(lastStands[body], ...local(...one)));
    const middle = [0, 1].map((axis) => others.reduce((sum, z) => sum + z[axis], 0) / others.length);
    const way = body ? [px(middle[0]) - u, py(middle[1]) - v] : [0, 20];
    const far = Math.hypot(...way);
    const gap = Math.min(20, far);
    if (far > 1) [u, v] = [u + (gap * way[0]) / far, v + (gap * way[1]) / far];
    // a place beyond 32 bits is none in a browser
    const seen = gripped && Math.hypot(u, v) < 1e9;
    group.setAttribute("display", seen ? "inline" : "none");
    if (!seen) continue;
    group.setAttribute("transform", `translate(${u.toFixed(1)} ${v.toFixed(1)})`);
    words.take(u, v, 6);
  }
};
toggle("h", TEXTS.handles, true, (on) => (gripped = on));

// --- for scripts ------------------------------------------------------------------------------------------------------------
window.dalembert = {
  names: [...inputNames, ...machine.kinds.keys()],
  set(changed) {
    const unknown = Object.keys(changed).find((name) => !isName(name));
    if (unknown !== undefined) {
      tell(TEXTS.unknown(unknown));
      return false;
    }
    remember();
    for (const [name, x] of Object.entries(changed)) {
      const why = refusal(name, x, String(x), "", positive.has(kindOf(name)));
      if (why) wrong.set(name, why);
      else {
        wrong.delete(name);
        put_({ [name]: x });
      }
    }
    update();
    return Boolean(state.rows && Number.isFinite(state.closed[shown]));
  },
  get(name) {
    if (isName(name)) return wrong.has(name) ? NaN : present(name);
    const quantity = model.quantities[name];
    return quantity ? machine.quantity(state, quantity)(shown) : NaN;
  },
  curve(name) {
    const quantity = model.quantities[name];
    const j = inputNames.indexOf(name);
    const at = j >= 0 ? (l) => machine.sweep[j][l] : quantity ? machine.quantity(state, quantity) : () => NaN;
    return Array.from({ length: n }, (_, l) => at(l));
  },
  limits: () => machine.limits(numbers).map(([q]) => q),
  options,
  toml,
};

// the pose that is shown at first: of the sweep where it is one of these
{
  const first = Array.from({ length: n }, (_, i) => i).find((i) => model.first.every((x, j) => machine.sweep[j][i] === x));
  shown = first ?? n;
}
watchers.push(() => {
  copied("");
  listFields();
  tell();
});
start({ resize });
listLimits();
