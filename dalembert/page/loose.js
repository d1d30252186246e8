// Free-body diagrams: every link cut loose at the shown pose, all links to one scale and all forces to one scale.
const loose = { host: null, panels: [] };
const SHADES = { weight: "weight", "inertia force": "inertia", "joint force": "force" };
function looseOn(on) {
  loose.host?.remove();
  loose.host = on ? make("section", { id: "loose", "aria-label": TEXTS.freeBodies }) : null;
  if (!on) return;
  $("values").prepend(loose.host);
  loose.note = put(loose.host, "p", { class: "soft" });
  loose.panels = whole.loose.map(({ b, parts }) => {
    const box = put(loose.host, "figure");
    put(box, "figcaption", {}, whole.bodies[b].name);
    const picture = svgIn(box, TEXTS.freeBodyOf(whole.bodies[b].name));
    return { b, parts, picture, lines: put(picture, "g"), words: texts(picture), line: put(box, "p", { class: "soft" }) };
  });
}
// what acts on a link at a pose: forces with their places, torques
function actions(parts, i) {
  const value = (part) => {
    const [x, y] = part.f.map((k) => part.s * at(whole, k, i));
    return part.along ? part.along.map((k) => x * at(whole, k, i)) : [x, y];
  };
  const forces = parts.filter((part) => part.at).map((part) => ({ ...part, place: part.at.map((k) => at(whole, k, i)), force: value(part) }));
  const torques = parts.filter((part) => !part.at).map((part) => ({ ...part, torque: value(part)[0] }));
  return { forces, torques };
}
const four = (x) => String(Number(x.toPrecision(4)));
function drawLoose(i) {
  if (!loose.host) return;
  const links = loose.panels.map((panel) => ({
    ...panel,
    ...actions(panel.parts, i),
    points: whole.bodies[panel.b].points.map((p) => [at(whole, whole.points[p].x, i), at(whole, whole.points[p].y, i)]),
  }));
  const real = links.every(({ points }) => points.flat().every(Number.isFinite));
  const sizes = links.flatMap(({ forces }) => forces.map(({ force }) => Math.hypot(...force)).filter(Number.isFinite));
  const largest = Math.max(0, ...sizes);
  loose.note.textContent = real ? TEXTS.toOneScale(four(largest)) : TEXTS.open;
  const across = (values) => (values.length ? Math.max(...values) - Math.min(...values) : 0);
  const widest = Math.max(0, ...links.flatMap(({ points }) => [0, 1].map((k) => across(points.map((z) => z[k]))))) || 1;
  const each = largest ? (0.8 * widest) / largest : 0;
  for (const link of links) {
    link.forces = link.forces.filter(({ force }) => Math.hypot(...force) > 1e-9 * largest);
    link.corners = [...link.points, ...link.forces.flatMap(({ place, force }) => [place, place.map((x, k) => x + each * force[k])])];
  }
  const spread = Math.max(0, ...links.flatMap(({ corners }) => [0, 1].map((k) => across(corners.map((z) => z[k]))))) || 1;
  const side = Math.max(180, Math.min(300, loose.host.clientWidth));
  const scale_ = (side - 84) / spread;
  for (const link of links) {
    sized(link.picture, side, side);
    link.lines.replaceChildren();
    const middle = [0, 1].map((k) => (Math.max(...link.corners.map((z) => z[k])) + Math.min(...link.corners.map((z) => z[k]))) / 2);
    const spot = ([x, y]) => [side / 2 + scale_ * (x - middle[0]), side / 2 - scale_ * (y - middle[1])];
    if (real) drawLink(link, spot, each * scale_, side);
    link.words.done();
    const torques = link.torques.filter(({ torque }) => Math.abs(torque) > 1e-12 * largest * widest).map(({ n: name, torque }) => `${name} = ${four(torque)} N·m`);
    link.line.textContent = real ? torques.join("; ") : "";
  }
}
function drawLink({ b, points, forces, lines, words }, spot, each, side) {
  const corners = points.map(spot);
  if (corners.length > 1) put(lines, "path", { class: `link ${corners.length > 2 ? "closed" : ""} ${classOf(b)}`, d: `M${corners.map((z) => fixed(...z)).join("L")}${corners.length > 2 ? "Z" : ""}` });
  words.begin(side, side);
  for (const [u, v] of corners) words.take(u, v, 4);
  for (const [u, v] of corners) put(lines, "circle", { class: "pin", cx: u.toFixed(2), cy: v.toFixed(2), r: 3.5 });
  const tips = forces.map(({ place, force, k, n: name }) => {
    const [u, v] = spot(place);
    const [du, dv] = [each * force[0], -each * force[1]];
    put(lines, "path", { class: SHADES[k] ?? "load", d: arrow(u, v, du, dv) });
    return { tip: [u + du, v + dv], way: direction([du, dv]), text: `${name} ${four(Math.hypot(...force))} N`, kind: SHADES[k] ?? "load" };
  });
  for (const { tip, way, text, kind } of tips) words.set(text, around(tip, way, [12, 24, 38], text), kind, true);
}
if (whole.loose) {
  toggle("b", TEXTS.freeBodies, false, (on) => {
    looseOn(on);
    drawLoose(shown);
  });
  watchers.push(drawLoose);
}
