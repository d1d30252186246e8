// What pages of poses share: play and pause, slider, table, plots. A scene (plane.js, space.js) draws.
for (const series of data.series) {
  // what is computed here has one pose more than the sweep: the free one
  for (const column of series.columns) column.values = data.model && series === data.series[0] ? new Float64Array(series.n + 1).fill(NaN) : unpack(column, series.n);
}
if (data.model) begin(data);

// --- the pose shown, and time -----------------------------------------------------------------------------------------
const whole = data.series[0];
const n = whole.n;
const watchers = []; // called with each new pose
let shown = 0;
function show(i) {
  // the pose beyond the last is the free one of a page that computes
  shown = data.model && i === n ? n : Math.max(0, Math.min(n - 1, Math.round(i)));
  if (shown < n) $("slider").value = shown;
  $("slider").setAttribute("aria-valuetext", inputsText(shown));
  $("pose").textContent = `${inputsText(shown)}${n > 1 && shown < n ? `  (${TEXTS.poseOf(shown + 1, n)})` : ""}`;
  for (const watch of watchers) watch(shown);
}
function inputsText(i) {
  return whole.over.map((k) => `${whole.columns[k].header} ${short(whole.columns[k].values[i])}`).join(", ");
}
// seconds at speed 1 at which each pose is due: the poses' own time, or some seconds for a turn of the input
const clock = data.clock === undefined ? Float64Array.from({ length: n }, (_, i) => (i * data.lasts) / Math.max(1, n - 1)) : whole.columns[data.clock].values.subarray(0, n).map((t) => t * (whole.columns[data.clock].si ?? 1));
const begins = clock[0];
const lasts = clock[n - 1] - clock[0];
const speeds = Array.from({ length: 21 }, (_, i) => 2 ** (i - 10));
let speed = 10;
let playing = false;
let place = 0; // seconds since the beginning
let way = 1;
let last;
// a sweep that does not come back to its beginning is played back and forth
const wraps = data.wraps ?? true;
function play(on) {
  playing = on && lasts > 0;
  $("play").textContent = playing ? "❚❚" : "▶";
  $("play").setAttribute("aria-label", playing ? TEXTS.pause : TEXTS.play);
  if (!playing) return;
  if (shown === n) show(Number($("slider").value));
  place = clock[shown] - begins;
  if (!wraps && shown === n - 1) way = -1;
  if (!wraps && shown === 0) way = 1;
  last = undefined;
  requestAnimationFrame(frame);
}
function frame(now) {
  if (!playing) return;
  if (last !== undefined) place += (way * speeds[speed] * Math.min(now - last, 200)) / 1000;
  last = now;
  if (wraps) place = ((place % lasts) + lasts) % lasts;
  else if (place > lasts) [place, way] = [Math.max(0, 2 * lasts - place), -1];
  else if (place < 0) [place, way] = [Math.min(lasts, -place), 1];
  let [low, high] = [0, n - 1];
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (clock[middle] - begins <= place) low = middle;
    else high = middle;
  }
  const near = place - (clock[low] - begins) < clock[high] - begins - place ? low : high;
  if (near !== shown) show(near);
  requestAnimationFrame(frame);
}
function jump(i) {
  play(false);
  show(Math.min(i, n - 1));
}
function faster(by) {
  speed = Math.max(0, Math.min(speeds.length - 1, speed + by));
  $("speed").selectedIndex = speed;
}

// --- controls ---------------------------------------------------------------------------------------------------------
function controls() {
  for (const [id, [label, title]] of Object.entries(TEXTS.controls)) {
    $(id).setAttribute("aria-label", label);
    if (title) $(id).title = title;
  }
  $("speed").before(TEXTS.speed);
  $("more").textContent = TEXTS.anotherPlot;
  $("slider").max = n - 1;
  for (const id of ["slider", "play", "first", "back", "ahead", "speed"]) $(id).disabled = n < 2;
  for (const kind of ["input", "change"]) $("slider").addEventListener(kind, () => jump(Number($("slider").value)));
  for (const [i, s] of speeds.entries()) put($("speed"), "option", { value: i }, s < 1 ? `1/${1 / s}` : `${s}`);
  // what takes less than 3 s or more than 20 s is shown slower or faster at first
  while (lasts > 0 && lasts / speeds[speed] < 3 && speed > 0) speed--;
  while (lasts / speeds[speed] > 20 && speed < speeds.length - 1) speed++;
  faster(0);
  $("speed").addEventListener("change", () => (speed = $("speed").selectedIndex));
  onKey(" ", TEXTS.playPause, () => play(!playing));
  onKey("ArrowLeft", TEXTS.keyBack, (e) => jump(shown - (e.shiftKey ? 10 : 1)));
  onKey("ArrowRight", TEXTS.keyAhead, (e) => jump(shown + (e.shiftKey ? 10 : 1)));
  onKey("Home", TEXTS.firstPose, () => jump(0));
  onKey("End", TEXTS.lastPose, () => jump(n - 1));
  onKey("-", TEXTS.slower, () => faster(-1));
  onKey("+", TEXTS.faster, () => faster(1));
  $("play").addEventListener("click", () => play(!playing));
  $("first").addEventListener("click", () => jump(0));
  $("back").addEventListener("click", () => jump(shown - 1));
  $("ahead").addEventListener("click", () => jump(shown + 1));
}
function toggle(key, words, on, change, possible = true) {
  const button = put($("toggles"), "button", { type: "button", "aria-pressed": on && possible, title: `${words} (${key})`, "data-toggle": words }, words);
  button.disabled = !possible;
  const flip = () => {
    if (button.disabled) return;
    const now = button.getAttribute("aria-pressed") !== "true";
    button.setAttribute("aria-pressed", now);
    change(now);
    show(shown);
  };
  button.addEventListener("click", flip);
  onKey(key, words, flip);
}
// --- the table of a pose ----------------------------------------------------------------------------------------------
// rows: [name, [column or null, ...]]; the columns marked exact show every digit
function table(caption, heads, rows, exactly, more) {
  const shownRows = grid($("values"), caption, ["", ...heads]);
  const cells = [];
  for (const [name, columns] of rows) {
    const row = shownRows.row(name, { "data-name": name });
    for (const [k, column] of columns.entries()) cells.push([put(row, "td"), column, exactly(k)]);
    if (more) more(row, name);
  }
  watchers.push((i) => {
    for (const [cell, k, every] of cells) {
      const x = k === null ? NaN : whole.columns[k].values[i];
      if (data.model) fillHeld(cell, k, i, every);
      else if (every) fill(cell, exact(x));
      else cell.textContent = k === null ? "" : short(x);
    }
  });
}

// what is smaller than this in a column is the rounding of zero: a share of the largest number in its unit, as in the program's pictures
const unitIn = (header) => header.replace(/^(?:.*_)?(?:[vajf]?[xy]|[a-z]{4,})_/, "");
function noiseOf(column) {
  const like = whole.columns.filter(({ header }) => header && unitIn(header) === unitIn(column.header));
  const ends = like.flatMap(({ values }) => range(values.subarray(0, n))).filter(Number.isFinite);
  return 1e-12 * Math.max(0, ...ends.map(Math.abs));
}

// --- plots ------------------------------------------------------------------------------------------------------------
const plots = [];
const FEW = 40; // of so many poses each has a dot: what lies between them was not computed
function plot(column) {
  const host = put($("plots"), "div", { class: "plot" });
  const line = put(host, "div");
  const choice = put(line, "select", { "aria-label": TEXTS.column });
  const groups = new Map();
  for (const [k, c] of whole.columns.entries()) {
    if (!c.header) continue;
    const group = groups.get(c.owner) ?? put(choice, "optgroup", { label: c.owner || TEXTS.input });
    groups.set(c.owner, group);
    put(group, "option", { value: k }, c.header);
  }
  choice.value = column;
  const value = put(line, "output");
  const away = put(line, "button", { type: "button", "aria-label": TEXTS.removePlot, title: TEXTS.removePlot }, "×");
  const svg = svgIn(host);
  const x = data.x === undefined ? Float64Array.from({ length: n + 1 }, (_, i) => i + 1) : whole.columns[data.x].values;
  const margin = { left: 58, right: 18, top: 8, bottom: 30 };
  let cursor, dot, px, py;
  let noise = 0;
  const quiet = (y) => (Math.abs(y) < noise ? 0 : y);
  let width;
  const chart = {
    // the width is read where the window has changed: it makes the browser lay out the whole page
    lay() {
      width = Math.max(200, host.clientWidth);
      chart.draw();
    },
    draw() {
      const k = Number(choice.value);
      const height = 150;
      svg.replaceChildren();
      sized(svg, width, height);
      put(svg, "title", {}, whole.columns[k].header);
      const lines = data.series.map((s) => (s.hidden?.() ? [] : (s.columns[k]?.values.subarray(0, s.n) ?? [])));
      noise = noiseOf(whole.columns[k]);
      let [low, high] = range(lines.flatMap((values) => range(values)).filter(Number.isFinite).map(quiet));
      const nothing = !(low <= high);
      if (nothing) [low, high] = [0, 1];
      // what varies by rounding alone is constant
      const varies = high - low > noise;
      const pad = varies ? (high - low) * 0.06 : Math.abs(high) * 0.1 || 1;
      [low, high] = [low - pad, high + pad];
      let [left, right] = range(x.subarray(0, n));
      if (left === right) [left, right] = [left - 1, right + 1];
      px = (v) => margin.left + ((v - left) / (right - left)) * (width - margin.left - margin.right);
      py = (v) => height - margin.bottom - ((v - low) / (high - low)) * (height - margin.top - margin.bottom);
      const under = data.x === undefined ? TEXTS.pose : whole.columns[data.x].header;
      for (const t of ticks(left, right, stepOf(left, right, Math.max(2, width / 70), under.endsWith("_deg")))) {
        put(svg, "line", { class: "grid", x1: px(t), x2: px(t), y1: margin.top, y2: height - margin.bottom });
        put(svg, "text", { class: "tick", x: px(t), y: height - margin.bottom + 15, "text-anchor": "middle" }, short(t));
      }
      // of what is zero everywhere, or nowhere, a scale would be made up
      for (const t of nothing ? [] : varies || low + high ? ticks(low, high, stepOf(low, high, 5)) : [0]) {
        put(svg, "line", { class: "grid", x1: margin.left, x2: width - margin.right, y1: py(t), y2: py(t) });
        put(svg, "text", { class: "tick", x: margin.left - 5, y: py(t) + 3, "text-anchor": "end" }, short(t));
      }
      put(svg, "text", { class: "tick", x: width - margin.right, y: height - 4, "text-anchor": "end" }, under);
      const jumps = /deg$/.test(whole.columns[k].header) ? 180 : Infinity;
      for (const [s, values] of [...lines.entries()].reverse()) {
        if (!values.length) continue;
        let d = "";
        let pen = false;
        let before = NaN;
        const few = values.length <= FEW;
        for (const i of sampled(values, 4000)) {
          const y = values[i];
          if (!Number.isFinite(y)) pen = false;
          else {
            if (Math.abs(y - before) > jumps) pen = false;
            before = y;
            d += (pen ? "L" : "M") + fixed(px(x[i] ?? i), py(y));
            pen = true;
            // to a pose without neighbours no line leads
            if (few || !(Number.isFinite(values[i - 1]) || Number.isFinite(values[i + 1]))) put(svg, "circle", { class: s ? "spot ghost" : "spot", cx: px(x[i] ?? i).toFixed(2), cy: py(y).toFixed(2), r: 2.2 });
          }
        }
        put(svg, "path", { class: s ? "curve ghost" : "curve", d });
      }
      cursor = put(svg, "line", { class: "cursor", y1: margin.top, y2: height - margin.bottom });
      dot = put(svg, "circle", { class: "dot", r: 4.5 });
      chart.at(shown);
    },
    at(i) {
      const y = quiet(whole.columns[Number(choice.value)].values[i]);
      for (const end of ["x1", "x2"]) cursor.setAttribute(end, px(x[i]));
      dot.style.display = Number.isFinite(y) ? "" : "none";
      if (Number.isFinite(y)) {
        dot.setAttribute("cx", px(x[i]));
        dot.setAttribute("cy", py(y));
      }
      value.textContent = short(y);
    },
  };
  const seek = (event) => {
    const at = event.clientX - svg.getBoundingClientRect().left;
    let near = 0;
    for (let i = 1; i < n; i++) if (Math.abs(px(x[i]) - at) < Math.abs(px(x[near]) - at)) near = i;
    jump(near);
  };
  svg.addEventListener("pointerdown", (event) => {
    svg.setPointerCapture(event.pointerId);
    seek(event);
  });
  svg.addEventListener("pointermove", (event) => {
    if (event.buttons) seek(event);
  });
  choice.addEventListener("change", () => chart.draw());
  away.addEventListener("click", () => {
    plots.splice(plots.indexOf(chart), 1);
    host.remove();
  });
  plots.push(chart);
  chart.lay();
}

// --- the beginning ------------------------------------------------------------------------------------------------------
// scene: {resize()} lays out anew where the window has another size
function start(scene) {
  controls();
  theme();
  watchers.push((i) => plots.forEach((one) => one.at(i)));
  const lay = () => {
    scene.resize();
    plots.forEach((one) => one.lay());
    show(shown);
  };
  lay();
  data.plots.forEach(plot);
  if (data.note) $("legend").before(make("p", { id: "note" }, data.note));
  $("more").addEventListener("click", () => plot(data.plots.at(-1)));
  let width = innerWidth;
  addEventListener("resize", () => {
    if (innerWidth !== width) lay();
    width = innerWidth;
  });
  // a sheet of paper has another width than the window
  addEventListener("beforeprint", lay);
  addEventListener("afterprint", lay);
}
