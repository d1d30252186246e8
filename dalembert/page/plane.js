// A planar mechanism: its shapes carried along by its bodies, arrows, instant centres, the velocity polygon.
// The drawing's own numbers are SI and radians; columns may be in other units (column.si).
const view = $("view");
const svg = svgIn(view, document.title);
const at = (series, k, i) => (k === null || k === undefined ? NaN : series.columns[k].values[i] * (series.columns[k].si ?? 1));
const classOf = (b) => (b ? `b${(b - 1) % 8}` : "ground");

// where body b stands at pose i: [x, y, cos, sin]; the ground comes first and stands still
function stand(series, b, i) {
  const body = series.bodies[b];
  if (!b) return [0, 0, 1, 0];
  const point = series.points[body.point];
  const angle = at(series, body.angle, i);
  const [c, s] = [Math.cos(angle), Math.sin(angle)];
  const [x, y] = body.at;
  return [at(series, point.x, i) - (c * x - s * y), at(series, point.y, i) - (s * x + c * y), c, s];
}
function carried([x, y, c, s], u, v) {
  return [x + c * u - s * v, y + s * u + c * v];
}
// whether a pose can be assembled
const real = (stands) => stands.every((where) => where.every(Number.isFinite));
// the points of a shape where its bodies stand
function outline(shape, stands) {
  const corners = [];
  const [p, ends] = [shape.p ?? shape.z, shape.ends];
  if (shape.n) {
    // one line n times, at steps of d
    for (let t = 0; t < shape.n; t++) for (let k = 0; k < p.length; k += 2) corners.push(carried(stands[shape.b], p[k] + t * shape.d[0], p[k + 1] + t * shape.d[1]));
    return corners;
  }
  for (let k = 0; k < p.length; k += 2) {
    if (!ends) corners.push(carried(stands[shape.b], p[k], p[k + 1]));
    else {
      // a spring: shares of its length, and sideways
      const from = carried(stands[ends[0]], ends[1], ends[2]);
      const to = carried(stands[ends[3]], ends[4], ends[5]);
      const way = [to[0] - from[0], to[1] - from[1]];
      const length = Math.hypot(...way) || 1;
      corners.push([from[0] + way[0] * p[k] - (way[1] / length) * p[k + 1], from[1] + way[1] * p[k] + (way[0] / length) * p[k + 1]]);
    }
  }
  return corners;
}

// --- the room that is needed over all poses ---------------------------------------------------------------------------
function room() {
  let [left, right, low, high] = [Infinity, -Infinity, Infinity, -Infinity];
  for (const series of data.series) {
    if (series.hidden?.()) continue;
    const step = Math.max(1, Math.floor(series.n / 90));
    for (let i = 0; i < series.n; i += step) {
      const stands = series.bodies.map((_, b) => stand(series, b, i));
      if (!real(stands)) continue;
      for (const shape of series.shapes) {
        for (const [x, y] of outline(shape, stands)) {
          const r = shape.s ?? 0;
          [left, right, low, high] = [Math.min(left, x - r), Math.max(right, x + r), Math.min(low, y - r), Math.max(high, y + r)];
        }
      }
    }
  }
  return left <= right ? [left, right, low, high] : [-1, 1, -1, 1];
}
let [left, right, low, high] = room();
const [MARGIN, RIM] = [34, 6]; // pixels around the shapes, and around the tips of arrows
const LEAST = { pin: 3.5, tip: 2.5, mass: 3 }; // pixels
let scale, px, py, width, height;

// --- what is drawn ----------------------------------------------------------------------------------------------------
const layers = { traces: put(svg, "g"), ghosts: put(svg, "g", { class: "ghost" }), main: put(svg, "g"), over: put(svg, "g") };
const figures = data.series.map((series, s) => {
  const group = put(s ? layers.ghosts : layers.main, "g");
  const parts = series.shapes.map((shape) => {
    const kind = shape.s === undefined ? (shape.c ? "closed" : "") : "disc";
    return put(group, shape.s === undefined ? "path" : "circle", { class: `${shape.r} ${kind} ${classOf(shape.b)}` });
  });
  return { series, group, parts };
});
const words = texts(layers.over);
const missing = put(layers.over, "text", { class: "missing" }, TEXTS.open);
const bar = put(layers.over, "path", { class: "scale" });
const drawn = { names: true, velocity: false, acceleration: false, force: whole.forces.length > 0, centres: false, polygon: false };
const traced = new Set(whole.points.filter((p) => p.trace).map((p) => p.name));

function drawFigure(figure, i) {
  const { series, group, parts } = figure;
  if (series.hidden?.()) {
    group.style.display = "none";
    return null;
  }
  const stands = series.bodies.map((_, b) => stand(series, b, i));
  // a page that computes keeps the last good pose, greyed, where there was one
  figure.stood ||= real(stands);
  const kept = data.model && series === whole && figure.stood;
  group.style.display = real(stands) || kept ? "" : "none";
  if (kept) group.classList.toggle("gone", !real(stands));
  if (!real(stands)) return null;
  for (const [k, shape] of series.shapes.entries()) {
    const points = outline(shape, stands);
    // lines of a row that do not hang together begin anew
    const each = shape.n && !shape.j ? points.length / shape.n : points.length;
    if (shape.s === undefined) parts[k].setAttribute("d", `${points.map(([x, y], l) => (l % each ? "L" : "M") + fixed(px(x), py(y))).join("")}${shape.c ? "Z" : ""}`);
    else {
      parts[k].setAttribute("cx", px(points[0][0]).toFixed(2));
      parts[k].setAttribute("cy", py(points[0][1]).toFixed(2));
    }
  }
  return stands;
}

// --- arrows -----------------------------------------------------------------------------------------------------------
// the places that move, each once, and the columns of their rates
const movers = whole.points.filter((p) => p.moves);
const longest = {};
const measures = []; // of the arrows, again after numbers have changed
function arrows(kind, tails) {
  const group = put(layers.over, "g");
  const parts = tails.map((tail) => put(group, "path", { class: kind }));
  const size = (i) => Math.max(0, ...tails.map(([, x, y]) => Math.hypot(at(whole, x, i), at(whole, y, i))).filter(Number.isFinite));
  let usual;
  const measure = () => {
    const sizes = Array.from({ length: n }, (_, i) => size(i));
    longest[kind] = Math.max(0, ...sizes);
    // one scale for all poses; a short peak may reach half across the picture
    usual = 2 * Math.sqrt(sizes.reduce((sum, x) => sum + x * x, 0) / n);
  };
  measure();
  measures.push(measure);
  // at a pose: where the arrows begin, in m, and what they are, in pixels, all with y downwards
  const vectors = (i) => {
    const length = (0.2 * Math.min(width, height)) / (Math.max(usual, longest[kind] / 2.5) || 1);
    return tails.map(([point, x, y]) => [at(whole, point.x, i), -at(whole, point.y, i), length * at(whole, x, i), -length * at(whole, y, i)]);
  };
  const draw = (i) => vectors(i).forEach(([x, y, u, v], k) => parts[k].setAttribute("d", drawn[kind] ? arrow(px(x), py(-y), u, v) : ""));
  // those that the margin may not hold, over all poses
  const wide = () => (drawn[kind] ? Array.from({ length: n }, (_, i) => vectors(i)).flat() : []).filter(([x, y, u, v]) => Number.isFinite(x + y) && Math.hypot(u, v) > MARGIN - RIM);
  return { draw, wide };
}
const rates = (key) => movers.filter((p) => p[key]).map((p) => [p, ...p[key]]);
const drawers = {
  velocity: arrows("velocity", rates("v")),
  acceleration: arrows("acceleration", rates("a")),
  force: arrows("force", whole.forces.map((f) => [whole.points[f.point], f.x, f.y])),
};

// --- headers ----------------------------------------------------------------------------------------------------------
const head = (k) => (k === null || k === undefined ? "" : data.series[0].columns[k].header);
const suffix = (text, name) => (text.startsWith(`${name}_`) ? text.slice(name.length + 1) : text);
const pointHeads = ["x", "y"].map((key) => suffix(head(whole.points[0]?.[key]), whole.points[0]?.name));
const lengths = whole.columns[whole.points[0]?.x]?.si ?? 1; // what one of their unit is in m

// --- instant centres: where two bodies have one velocity -------------------------------------------------------------
const velocities = movers.length > 0 && movers.every((p) => p.v) && whole.bodies.slice(1).every((b) => b.omega !== null);
const pinned = (a, b) => whole.pins.some((pin) => pin.includes(a) && pin.includes(b));
const pairs = whole.bodies.flatMap((_, b) => whole.bodies.slice(0, b).map((__, a) => [a, b])).filter(([a, b]) => !pinned(a, b));
// the velocity of a body's point that stands in the origin, and its angular velocity
function field(b, i) {
  if (!b) return [0, 0, 0];
  const body = whole.bodies[b];
  const p = whole.points[body.point];
  const omega = at(whole, body.omega, i);
  const [vx, vy] = p.v ? p.v.map((k) => at(whole, k, i)) : [0, 0];
  return [vx + omega * at(whole, p.y, i), vy - omega * at(whole, p.x, i), omega];
}
function centre(a, b, i) {
  const [f, g] = [field(a, i), field(b, i)];
  const turn = g[2] - f[2];
  return [-(g[1] - f[1]) / turn, (g[0] - f[0]) / turn];
}
const crosses = put(layers.over, "path", { class: "centre" });
let centreCells;
function drawCentres(i) {
  let d = "";
  for (const [k, [a, b]] of pairs.entries()) {
    const [x, y] = drawn.centres ? centre(a, b, i) : [NaN, NaN];
    const [u, v] = [px(x), py(y)];
    const fields = [...field(a, i), ...field(b, i)];
    // what is at rest against each other has no centre
    const real = fields.every(Number.isFinite) && fields.some((x) => x !== 0);
    const reach = right - left + high - low;
    const far = !(Math.hypot(x, y) < 1e6 * reach);
    // what is smaller is the rounding of zero
    const shownPart = (part) => short(Math.abs(part) < 1e-12 * reach ? 0 : part / lengths);
    centreCells?.[k].forEach((cell, axis) => (cell.textContent = real ? (far ? "∞" : shownPart([x, y][axis])) : "–"));
    if (!(u > -20 && u < width + 20 && v > -20 && v < height + 20)) continue;
    d += `M${fixed(u - 5, v - 5)}L${fixed(u + 5, v + 5)}M${fixed(u - 5, v + 5)}L${fixed(u + 5, v - 5)}`;
    const text = `${whole.bodies[a].name} / ${whole.bodies[b].name}`;
    words.set(text, around([u, v], [0, -1], [12], text), "centre");
  }
  crosses.setAttribute("d", d);
}
function centreTable(on) {
  $("centres")?.remove();
  centreCells = undefined;
  if (!on) return;
  const rows = grid($("values"), TEXTS.instantCentres, ["", ...pointHeads]);
  rows.box.id = "centres";
  centreCells = pairs.map(([a, b]) => {
    const row = rows.row(`${whole.bodies[a].name} / ${whole.bodies[b].name}`);
    return [put(row, "td"), put(row, "td")];
  });
}

// --- the velocity polygon: velocities from one pole; of each link an image of itself ---------------------------------
const polygon = { svg: null };
function polygonOn(on) {
  $("extra").replaceChildren();
  polygon.svg = on ? svgIn($("extra"), TEXTS.velocityPolygon) : null;
  if (!on) return;
  polygon.lines = put(polygon.svg, "g");
  polygon.words = texts(polygon.svg);
}
function drawPolygon(i) {
  if (!polygon.svg) return;
  const [w, h] = [$("extra").clientWidth, Math.min(320, $("extra").clientWidth)];
  sized(polygon.svg, w, h);
  const tips = new Map(whole.points.map((p) => [p, p.moves ? p.v.map((k) => at(whole, k, i)) : [0, 0]]));
  const real = [...tips.values()].filter(([x, y]) => Number.isFinite(x + y));
  const [xs, ys] = [range([0, ...real.map((v) => v[0])]), range([0, ...real.map((v) => v[1])])];
  const k = Math.min((w - 70) / (xs[1] - xs[0] || 1e-300), (h - 60) / (ys[1] - ys[0] || 1e-300));
  const X = (x) => w / 2 + k * (x - (xs[0] + xs[1]) / 2);
  const Y = (y) => h / 2 - k * (y - (ys[0] + ys[1]) / 2);
  polygon.lines.replaceChildren();
  for (const [b, body] of whole.bodies.entries()) {
    const image = body.points.map((p) => tips.get(whole.points[p])).filter(([x, y]) => Number.isFinite(x + y));
    if (!b || image.length < 2) continue;
    const d = `M${image.map(([x, y]) => fixed(X(x), Y(y))).join("L")}${image.length > 2 ? "Z" : ""}`;
    put(polygon.lines, "path", { class: `image ${classOf(b)}`, d });
  }
  const at_ = new Map(); // points of one velocity share a label
  for (const [p, [x, y]] of tips) {
    if (!Number.isFinite(x + y)) continue;
    if (p.moves) put(polygon.lines, "path", { class: "velocity", d: arrow(X(0), Y(0), X(x) - X(0), Y(y) - Y(0)) });
    const key = fixed(X(x), Y(y));
    at_.set(key, [...(at_.get(key) ?? []), p]);
  }
  polygon.words.begin(w, h);
  const middle = [X((xs[0] + xs[1]) / 2), Y((ys[0] + ys[1]) / 2)];
  for (const points of at_.values()) {
    const [x, y] = tips.get(points[0]);
    const tip = [X(x), Y(y)];
    const text = points.map((p) => p.name).join(", ");
    polygon.words.set(text, around(tip, direction([tip[0] - middle[0], tip[1] - middle[1]]), [14, 26, 40], text), "point");
  }
  polygon.words.done();
}

// --- paths ------------------------------------------------------------------------------------------------------------
function drawTraces() {
  layers.traces.replaceChildren();
  for (const [s, series] of data.series.entries()) {
    if (series.hidden?.()) continue;
    for (const p of series.points) {
      if (!traced.has(p.name)) continue;
      const [xs, ys] = p.path ?? [p.x, p.y].map((k) => series.columns[k].values.subarray(0, series.n).map((x) => x * (series.columns[k].si ?? 1)));
      let d = "";
      let pen = false;
      for (const i of sampled(xs, 4000)) {
        const real = Number.isFinite(xs[i]);
        if (real) d += (pen ? "L" : "M") + fixed(px(xs[i]), py(ys[i]));
        pen = real;
      }
      put(layers.traces, "path", { class: s ? "trace ghost" : "trace", d, "data-path": p.name });
    }
  }
}
for (const series of data.series) {
  if (series.fine) for (const p of series.points) p.path = p.path?.map((one) => unpack(one, series.fine));
}
// numbers have changed: what was measured over all poses
function refresh() {
  for (const measure of measures) measure();
  legend();
  drawTraces();
  plots.forEach((one) => one.draw());
  show(shown);
}
function fit() {
  [left, right, low, high] = room();
  resize();
}

// --- all of a pose ----------------------------------------------------------------------------------------------------
// at a point, on the side where none of its links leads away; a link's name in the middle of a plate or along a bar;
// where other names stand there, on another side, and nowhere if there is no room
const neighbours = whole.points.map((_, k) => [...new Set(whole.bodies.slice(1).filter((b) => b.points.includes(k)).flatMap((b) => b.points))].filter((other) => other !== k));
function labels(stands, i) {
  if (!stands || !drawn.names) return;
  const places = whole.points.map((p) => [px(at(whole, p.x, i)), py(at(whole, p.y, i))]);
  for (const [u, v] of places) words.take(u, v, 5);
  const across = ([du, dv]) => (du > 0 ? [dv, -du] : [-dv, du]);
  for (const label of whole.labels.filter((one) => one.of === "point")) {
    const k = whole.points.findIndex((p) => p.name === label.t);
    const [u, v] = places[k];
    const towards = neighbours[k].map((p) => direction([places[p][0] - u, places[p][1] - v]));
    // the foot of a fixed pivot
    if (!label.b) towards.push([0, 1.4]);
    let way = [0, 1].map((axis) => -towards.reduce((sum, one) => sum + one[axis], 0));
    if (Math.hypot(...way) < 0.35) way = across(towards[0] ?? [-1, 0]);
    words.set(label.t, around([u, v], direction(way), [15, 26], label.t), "point");
  }
  for (const label of whole.labels.filter((one) => one.of === "link")) {
    const [u, v] = carried(stands[label.b], ...label.z).map((x, axis) => [px, py][axis](x));
    const ends = whole.bodies[label.b].points.map((p) => places[p]);
    const along = ends.length > 1 ? [ends[1][0] - ends[0][0], ends[1][1] - ends[0][1]] : [0, 50];
    const side = across(direction(along)).map((x) => -x);
    const sides = [12, 22].flatMap((gap) => [1, -1].flatMap((sign) => [0, 0.2, -0.2].map((share) => {
      const [du, dv] = aside(label.t, side.map((x) => sign * x), gap);
      return [u + du + share * along[0], v + dv + share * along[1]];
    })));
    words.set(label.t, ends.length > 2 ? [[u, v], ...sides] : sides, `body ${classOf(label.b)}`);
  }
}
function legend() {
  const lines = [];
  const [first, ...others] = data.series.filter((series) => !series.hidden?.()).map((series) => series.name);
  if (others.length) lines.push(TEXTS.ghosts(first || TEXTS.asItIs, others.slice(0, 4).join("; "), Math.max(0, others.length - 4)));
  const of = (kind, unit) => longest[kind] && lines.push(TEXTS.longest(TEXTS.arrows[kind], `${short(longest[kind])} ${unit}`));
  if (drawn.velocity) of("velocity", data.units.v);
  if (drawn.acceleration) of("acceleration", data.units.a);
  if (drawn.force) of("force", data.units.f);
  if (drawn.polygon) lines.push(TEXTS.ofPolygon(data.units.v));
  $("legend").textContent = lines.join("; ");
}
function drawAll(i) {
  const [stands] = figures.map((figure) => drawFigure(figure, i));
  missing.style.display = stands ? "none" : "";
  words.begin(width, height);
  words.take(barAt[0], barAt[1], barAt[2], 12);
  drawHandles?.(stands);
  labels(stands, i);
  for (const { draw } of Object.values(drawers)) draw(i);
  drawCentres(i);
  words.put(barAt[0], barAt[1] - 6, barAt[3], "note");
  words.done();
  drawPolygon(i);
}
function sizeCircles() {
  for (const { series, parts } of figures) {
    for (const [k, shape] of series.shapes.entries()) if (shape.s !== undefined) parts[k].setAttribute("r", Math.max(shape.s * scale, LEAST[shape.r] ?? 0).toFixed(2));
  }
}
let drawHandles; // of a page that computes
let barAt; // its middle, half its length, its words
function resize() {
  width = Math.max(240, view.clientWidth);
  const shape = (high - low || right - left || 1) / (right - left || high - low || 1);
  height = Math.round(Math.max(0.4 * width, Math.min(shape * (width - 2 * MARGIN) + 2 * MARGIN, Math.max(300, 0.68 * innerHeight), 1.2 * width)));
  sized(svg, width, height);
  scale = Math.min((width - 2 * MARGIN) / (right - left || 1e-300), (height - 2 * MARGIN) / (high - low || 1e-300));
  // the shapes make room for long arrows, at most by half
  const tips = Object.values(drawers).flatMap(({ wide }) => wide());
  const spanOf = (from, to, axis) => tips.reduce(([least, most], one) => {
    const tip = scale * one[axis] + one[axis + 2];
    return [Math.min(least, tip - RIM), Math.max(most, tip + RIM)];
  }, [scale * from - MARGIN, scale * to + MARGIN]);
  const spans = () => [spanOf(left, right, 0), spanOf(-high, -low, 1)];
  for (let round = 0; round < 14 && spans().some(([least, most], axis) => most - least > [width, height][axis] + 0.01); round++) scale *= 0.95;
  const [u, v] = spans().map(([least, most]) => (least + most) / 2);
  px = (x) => width / 2 + scale * x - u;
  py = (y) => height / 2 - scale * y - v;
  sizeCircles();
  missing.setAttribute("x", width / 2);
  missing.setAttribute("y", 20);
  // a length to measure by
  const length = stepOf(0, width / scale, 5);
  const [x, y] = [14, height - 14];
  bar.setAttribute("d", `M${x} ${y - 4}V${y + 4}M${x} ${y}H${(x + length * scale).toFixed(1)}M${(x + length * scale).toFixed(1)} ${y - 4}V${y + 4}`);
  barAt = [x + (length * scale) / 2, y - 4, (length * scale) / 2, length < 1 ? `${short(1000 * length)} mm` : `${short(length)} m`];
  drawTraces();
}

// --- values and controls ------------------------------------------------------------------------------------------------
table(TEXTS.points, [...pointHeads, TEXTS.path], whole.points.map((p) => [p.name, [p.x, p.y]]), () => true, (row, name) => {
  const box = put(put(put(row, "td"), "label", { class: "box" }), "input", { type: "checkbox", "aria-label": TEXTS.pathOf(name) });
  box.checked = traced.has(name);
  box.addEventListener("change", () => {
    traced[box.checked ? "add" : "delete"](name);
    drawTraces();
  });
});
const links = whole.bodies.slice(1);
const turning = ["angle", "omega", "alpha"].filter((key) => links.some((b) => head(b[key])));
table(TEXTS.links, turning.map((key) => suffix(head(links[0][key]), links[0].name)), links.map((b) => [b.name, turning.map((key) => b[key])]), (k) => k === 0);
if (whole.forces.length) {
  table(TEXTS.jointForces, [`x, ${data.units.f}`, `y, ${data.units.f}`], whole.forces.map((f) => [f.name, [f.x, f.y]]), () => false);
}
const flips = (name, then) => (on) => {
  drawn[name] = on;
  then?.(on);
  legend();
};
toggle("n", TEXTS.names, drawn.names, flips("names"));
toggle("v", TEXTS.velocities, false, flips("velocity", fit), longest.velocity > 0);
toggle("a", TEXTS.accelerations, false, flips("acceleration", fit), longest.acceleration > 0);
if (whole.forces.length) toggle("f", TEXTS.forces, drawn.force, flips("force", fit), longest.force > 0);
toggle("i", TEXTS.centres, false, flips("centres", centreTable), velocities && longest.velocity > 0);
toggle("p", TEXTS.velocityPolygon, false, flips("polygon", polygonOn), velocities && longest.velocity > 0);
legend();
watchers.push(drawAll);
// a page that computes begins when its editor stands
if (!data.model) start({ resize });
