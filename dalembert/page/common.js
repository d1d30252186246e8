// What every page shares: elements, numbers, keys, dark and light.
const data = JSON.parse(document.getElementById("data").textContent);
const $ = (id) => document.getElementById(id);

// --- elements: text is always text --------------------------------------------------------------------------------
function make(name, attributes = {}, text) {
  const svg = ["svg", "g", "path", "circle", "line", "text", "title"].includes(name);
  const element = svg ? document.createElementNS("http://www.w3.org/2000/svg", name) : document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  if (text !== undefined) element.textContent = text;
  return element;
}
function put(parent, ...rest) {
  return parent.appendChild(make(...rest));
}
// a name or a unit that breaks, where it must, after its dots, underscores and slashes
function breaking(element, text) {
  element.append(...text.split(/(?<=[._·/])/).flatMap((piece, k) => (k ? [make("wbr"), piece] : [piece])));
  return element;
}
function svgIn(host, label) {
  return put(host, "svg", { role: "img", ...(label && { "aria-label": label }) });
}
// a table with its heads, in a box of its own that scrolls; `row` of it is a row with its name
function grid(host, caption, heads, attributes = {}) {
  const box = put(host, "div", { class: "scroll" });
  const table = put(box, "table", attributes);
  if (caption) put(table, "caption", {}, caption);
  const head = put(put(table, "thead"), "tr");
  for (const text of heads) breaking(put(head, "th", { scope: "col" }), text);
  const body = put(table, "tbody");
  return {
    box,
    row(name, attributes) {
      const line = put(body, "tr", attributes);
      breaking(put(line, "th", { scope: "row" }), name);
      return line;
    },
  };
}
// one unit of a picture is one pixel of the screen: words keep their size on a phone
function sized(svg, width, height) {
  for (const [key, value] of Object.entries({ width, height, viewBox: `0 0 ${width} ${height}` })) svg.setAttribute(key, value);
}
const LETTER = [3.4, 8]; // half a letter's width; half the height that a line of words keeps clear
// the words of a picture, made anew at every pose, each where nothing stands so far
function texts(parent) {
  const pool = [];
  let used = 0;
  let [width, height] = [Infinity, Infinity];
  let taken = []; // middles and half sides of what stands in the picture
  const free = ([u, v, w, h]) => taken.every(([x, y, a, b]) => Math.abs(u - x) > w + a || Math.abs(v - y) > h + b);
  return {
    begin(...size) {
      [width, height] = size;
      taken = [];
    },
    take: (u, v, w, h = w) => taken.push([u, v, w, h]),
    put(x, y, text, kind) {
      const one = pool[used] ?? (pool[used] = put(parent, "text"));
      used++;
      one.setAttribute("x", x.toFixed(1));
      one.setAttribute("y", y.toFixed(1));
      one.setAttribute("class", kind);
      one.textContent = text;
    },
    // in the first free one of some places, within the picture; where none is, in the first if it must be there, else nowhere
    set(text, places, kind, must = false) {
      const most = Math.floor((width - 3) / 2 / LETTER[0]);
      if (text.length > most) text = `${text.slice(0, most - 1)}…`;
      const [w, h] = [LETTER[0] * text.length + 1.5, LETTER[1]];
      const boxes = places.map(([u, v]) => [Math.min(Math.max(u, w), width - w), Math.min(Math.max(v, h), height - h), w, h]);
      const box = boxes.find(free) ?? (must ? boxes[0] : null);
      if (!box) return;
      taken.push(box);
      this.put(box[0], box[1], text, kind);
    },
    done() {
      while (pool.length > used) pool.pop().remove();
      used = 0;
    },
  };
}
// upwards where there is none
const direction = ([x, y]) => (x || y ? [x / Math.hypot(x, y), y / Math.hypot(x, y)] : [0, -1]);
// how far aside the middle of a word stands: a long one farther to the left or right
const aside = (text, [du, dv], gap) => [du * (gap + Math.max(0, LETTER[0] * (text.length - 2))), dv * gap];
// places of a word around a point, nearest to a direction first
function around([u, v], [c, s], gaps, text) {
  return gaps.flatMap((gap) => [0, 1, -1, 2, -2, 3, -3, 4].map((eighth) => {
    const [p, q] = [Math.cos((eighth * Math.PI) / 4), Math.sin((eighth * Math.PI) / 4)];
    const [du, dv] = aside(text, [c * p - s * q, c * q + s * p], gap);
    return [u + du, v + dv];
  }));
}
function arrow(x, y, dx, dy) {
  const length = Math.hypot(dx, dy);
  if (!(length > 1.5)) return "";
  const [u, v] = [dx / length, dy / length];
  const head = Math.min(9, length / 2);
  const end = [x + dx, y + dy];
  const barb = (side) => [end[0] - head * (u - side * 0.42 * v), end[1] - head * (v + side * 0.42 * u)];
  return `M${fixed(x, y)}L${fixed(...end)}M${fixed(...barb(1))}L${fixed(...end)}L${fixed(...barb(-1))}`;
}
function fixed(x, y) {
  return `${x.toFixed(2)} ${y.toFixed(2)}`;
}

// --- numbers --------------------------------------------------------------------------------------------------------
function unpack(column, n) {
  if ("all" in column) return new Float64Array(n).fill(column.all);
  const Kind = "f8" in column ? Float64Array : Float32Array;
  const bytes = Uint8Array.from(atob(column.f8 ?? column.f4), (c) => c.charCodeAt(0));
  // least significant byte first on every machine that shows pages
  return new Kind(bytes.buffer);
}
// every digit, as the CSV has it
function exact(x) {
  if (!Number.isFinite(x)) return "–";
  const [mantissa, power] = x.toExponential().split("e");
  const e = Number(power);
  if (x !== 0 && (e < -4 || e >= 16)) return `${mantissa}e${e < 0 ? "-" : "+"}${String(Math.abs(e)).padStart(2, "0")}`;
  return Number.isInteger(x) ? `${x === 0 ? 0 : x}.0` : String(x);
}
// six digits, as a table on a terminal has them
function short(x) {
  return Number.isFinite(x) ? String(Number(x.toPrecision(6))) : "–";
}
// a cell with every digit, those beyond the sixth small
function fill(cell, text) {
  const [, lead, rest, power] = /^(-?(?:0\.0*)?(?:\d\.?){1,6})(\d*\.?\d*)(e.*)?$/.exec(text) ?? [0, text, "", ""];
  cell.replaceChildren(lead);
  if (rest) put(cell, "small", {}, rest);
  if (power) cell.append(power);
}
// which of n samples are drawn: of very many the first, the last, the least and the largest of each few
function sampled(values, most) {
  const n = values.length;
  if (n <= most) return Array.from({ length: n }, (_, i) => i);
  const some = new Set([0, n - 1]);
  const step = Math.ceil((3 * n) / most);
  for (let from = 0; from < n; from += step) {
    let [low, high] = [from, from];
    for (let i = from; i < Math.min(n, from + step); i++) {
      // a gap stays one
      if (!Number.isFinite(values[i])) some.add(i);
      if (values[i] < values[low]) low = i;
      if (values[i] > values[high]) high = i;
    }
    some.add(low).add(high).add(from);
  }
  return [...some].sort((a, b) => a - b);
}
function range(values) {
  let [low, high] = [Infinity, -Infinity];
  for (const x of values) {
    if (x < low) low = x;
    if (x > high) high = x;
  }
  return [low, high];
}
// the step at which at most so many ticks fit; degrees over much of a turn go by parts of it
function stepOf(low, high, most, degrees = false) {
  const rough = (high - low) / most;
  const power = 10 ** Math.floor(Math.log10(rough));
  const turned = degrees && rough > 10 ? [15, 30, 60, 90, 180, 360, 720, 3600].find((m) => m >= rough) : undefined;
  return turned ?? power * [1, 2, 5, 10].find((m) => m * power >= rough * (1 - 1e-9));
}
function ticks(low, high, step) {
  const first = Math.ceil(low / step - 1e-9);
  const count = Math.min(Math.floor(high / step + 1e-9) - first + 1, 50);
  return Array.from({ length: Math.max(0, count) }, (_, k) => Number(((first + k) * step).toPrecision(12)));
}

// --- keys, dark and light -----------------------------------------------------------------------------------------------
const keys = new Map(); // key -> [what it does, its words]
function onKey(key, words, act) {
  keys.set(key, act);
  $("keys").append(`${key === " " ? TEXTS.space : key}: ${words}. `);
}
document.addEventListener("keydown", (event) => {
  const act = keys.get(event.key);
  const here = event.target;
  if (!act || event.ctrlKey || event.metaKey || event.altKey || ["SELECT", "TEXTAREA"].includes(here.tagName)) return;
  // what has the focus keeps its own keys: space presses it, arrows move in a text
  if (event.key === " " && (["BUTTON", "SUMMARY"].includes(here.tagName) || here.type === "checkbox")) return;
  event.preventDefault();
  act(event);
});
function theme() {
  const dark = matchMedia("(prefers-color-scheme: dark)");
  let own = null;
  const set = () => (document.documentElement.dataset.theme = own ?? (dark.matches ? "dark" : "light"));
  const flip = () => {
    own = document.documentElement.dataset.theme === "dark" ? "light" : "dark";
    set();
  };
  dark.addEventListener("change", set);
  $("theme").addEventListener("click", flip);
  $("theme").setAttribute("aria-label", TEXTS.theme);
  $("theme").title = `${TEXTS.theme} (d)`;
  document.querySelector("footer summary").textContent = TEXTS.keys;
  onKey("d", TEXTS.theme, flip);
  set();
}
