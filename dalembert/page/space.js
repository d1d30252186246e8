// A body that turns in space, seen from where the reader turns the view to: the body, ω, the angular momentum, a trace.
const view = $("view");
view.classList.add("turns");
const svg = svgIn(view, document.title);
const { solid, axis } = data;
const at = (k, i) => whole.columns[k].values[i] * (whole.columns[k].si ?? 1);
const three = (columns, i) => columns.map((k) => at(k, i));

// body to space by a unit quaternion [w, x, y, z]
function turned(i, [u, v, t]) {
  const [w, x, y, z] = three(data.attitude, i);
  const [a, b, c] = [y * t - z * v, z * u - x * t, x * v - y * u];
  return [u + 2 * (w * a + y * c - z * b), v + 2 * (w * b + z * a - x * c), t + 2 * (w * c + x * b - y * a)];
}

// --- where it is seen from --------------------------------------------------------------------------------------------
let azimuth = 0.6;
let elevation = 0.42;
let width, height, scale;
const REACH = 1.5; // of the picture, where the body is at most 1 and its sphere SPHERE
const SPHERE = 1.2;
function seen([x, y, z]) {
  const [s, c, se, ce] = [Math.sin(azimuth), Math.cos(azimuth), Math.sin(elevation), Math.cos(elevation)];
  const depth = ce * c * x + ce * s * y + se * z;
  return [width / 2 + scale * (c * y - s * x), height / 2 - scale * (ce * z - se * (c * x + s * y)), depth];
}
function ray(tip) {
  const [x, y] = seen([0, 0, 0]);
  const [u, v] = seen(tip);
  return arrow(x, y, u - x, v - y);
}
const times = (f, v) => v.map((x) => f * x);

// --- what is drawn ----------------------------------------------------------------------------------------------------
const sphere = put(svg, "circle", { class: "faint" });
const axes = [0, 1, 2].map(() => put(svg, "path", { class: "faint" }));
const trace = [put(svg, "path", { class: "trace back" }), put(svg, "path", { class: "trace" })];
const faces = solid.faces.map((face) => put(svg, "path", { class: `face b${face.color}` }));
const own = [0, 1, 2].map((k) => put(svg, "path", { class: `b${[4, 2, 0][k]}`, "stroke-width": 2 }));
const arrows = { velocity: put(svg, "path", { class: "velocity" }), momentum: put(svg, "path", { class: "force" }) };
const dot = put(svg, "circle", { class: "tip", r: 3.5 });
const words = texts(put(svg, "g"));
const drawn = { names: true, axes: true, velocity: true, momentum: true, trace: true };
const columns = { velocity: data.omega, momentum: data.momentum };
const longest = Object.fromEntries(Object.entries(columns).map(([kind, ks]) => [kind, Math.max(0, ...Array.from({ length: n }, (_, i) => Math.hypot(...three(ks, i))))]));
const path = Array.from({ length: n }, (_, i) => times(SPHERE, turned(i, axis)));

function drawBody(i) {
  const corners = solid.corners.map((p) => seen(turned(i, p)));
  for (const [k, { corners: ring }] of solid.faces.entries()) {
    const points = ring.map((c) => corners[c]);
    const area = points.reduce((sum, [x, y], j) => sum + x * points[(j + 1) % ring.length][1] - y * points[(j + 1) % ring.length][0], 0);
    // of a convex body those faces are seen that look towards the reader
    faces[k].setAttribute("d", area < 0 ? `M${points.map(([x, y]) => fixed(x, y)).join("L")}Z` : "");
  }
}
function drawTrace() {
  const d = ["", ""];
  let side = -1;
  for (const [i, p] of (drawn.trace ? path : []).entries()) {
    const [x, y, depth] = seen(p);
    const now = depth < 0 ? 0 : 1;
    // a piece begins where the last one ended
    d[now] += now === side ? `L${fixed(x, y)}` : i ? `M${fixed(...seen(path[i - 1]))}L${fixed(x, y)}` : `M${fixed(x, y)}`;
    side = now;
  }
  trace.forEach((part, k) => part.setAttribute("d", d[k]));
}
// a name at the tip of an arrow from the centre
function named(tip, text, kind) {
  const [x, y] = seen(tip);
  words.set(text, around([x, y], direction([x - width / 2, y - height / 2]), [11, 22], text), kind);
}
function drawAll(i) {
  drawBody(i);
  words.begin(width, height);
  const rays = { velocity: turned(i, three(data.omega, i)), momentum: three(data.momentum, i) };
  for (const [kind, vector] of Object.entries(rays)) {
    const tip = times(1.3 / (longest[kind] || 1), vector);
    arrows[kind].setAttribute("d", drawn[kind] ? ray(tip) : "");
    if (drawn[kind] && drawn.names && longest[kind]) named(tip, kind === "velocity" ? "ω" : "H", "point");
  }
  const ends = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
  for (const [k, e] of ends.entries()) {
    axes[k].setAttribute("d", ray(times(1.35, e)));
    if (drawn.names) named(times(1.35, e), "xyz"[k], "note");
  }
  for (const [k, e] of ends.entries()) {
    const tip = times(1.12, turned(i, e));
    own[k].setAttribute("d", drawn.axes ? ray(tip) : "");
    if (drawn.names && drawn.axes) named(tip, `body ${"xyz"[k]}`, "note");
  }
  const [x, y] = seen(path[i]);
  dot.setAttribute("cx", x);
  dot.setAttribute("cy", y);
  dot.style.display = drawn.trace ? "" : "none";
  words.done();
}
function resize() {
  width = Math.max(240, view.clientWidth);
  height = Math.round(Math.min(width, Math.max(300, 0.66 * innerHeight)));
  scale = Math.min(width, height) / (2 * REACH);
  sized(svg, width, height);
  for (const [key, value] of Object.entries({ cx: width / 2, cy: height / 2, r: SPHERE * scale })) sphere.setAttribute(key, value);
  drawTrace();
}

// --- values and controls ----------------------------------------------------------------------------------------------
function rows(caption, columns, every) {
  table(caption, [""], columns.map((k) => [whole.columns[k].header, [k]]), () => every);
}
rows(TEXTS.omega, data.omega, true);
rows(TEXTS.attitude, data.attitude, true);
rows(TEXTS.momentumAndEnergy, [...data.momentum, data.energy], false);
const flip = (name) => (on) => {
  drawn[name] = on;
  drawTrace();
};
toggle("n", TEXTS.names, true, flip("names"));
toggle("b", TEXTS.bodyAxes, true, flip("axes"));
toggle("w", TEXTS.angularVelocity, true, flip("velocity"), longest.velocity > 0);
toggle("m", TEXTS.angularMomentum, true, flip("momentum"), longest.momentum > 0);
toggle("t", TEXTS.traceOfAxis, true, flip("trace"));
$("legend").textContent = TEXTS.traceOf(data.traced);
svg.addEventListener("pointerdown", (event) => svg.setPointerCapture(event.pointerId));
svg.addEventListener("pointermove", (event) => {
  if (!event.buttons) return;
  azimuth -= event.movementX / 150;
  elevation = Math.max(-1.55, Math.min(1.55, elevation + event.movementY / 150));
  drawTrace();
  drawAll(shown);
});
watchers.push(drawAll);
start({ resize });
