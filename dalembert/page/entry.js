// Numbers that are typed, with their units; numbers that are shown, with the digits that hold.
// --- units: words, and words joined, as `composed` of the program's table of units reads them ----------------------------------
const { signs, joined, perMinute, readAs, largest, ...unitTable } = data.unitTable;
const [unitWords, inFull] = [unitTable.words, unitTable.inFull].map((table) => new Map(Object.entries(table)));
function plainUnit(text) {
  if (new RegExp(`^(?:${perMinute})$`).test(text.toLowerCase())) return "rpm";
  for (const [mark, words] of Object.entries(readAs)) {
    const [, size] = new RegExp(`^(.*[^\\s_])[\\s_]+(?:${words})$`, "i").exec(text) ?? [];
    if (size) return `${plainUnit(size)} ${mark}`;
  }
  const plain = text.replace(/[^\x00-\x7f]/g, (sign) => (Object.hasOwn(signs, sign) ? signs[sign] : sign)).replaceAll("**", "^").replace(/([A-Za-z])-(?=[A-Za-z])/g, "$1*");
  return plain.replace(/[A-Za-z]+/g, (word) => {
    const parts = new RegExp(`^(?:${joined})$`).exec(word);
    return parts ? parts.slice(1).filter(Boolean).join("*") : inFull.get(word.toLowerCase()) ?? word;
  });
}
// the factor of a unit as [numerator, denominator], whole numbers as they are, and its exponents; null where it is none
const composed = remembered((text) => {
  const times = (a, b) => (typeof a === "bigint" && Number.isInteger(b) ? a * BigInt(b) : Number(a) * b);
  const factor = [1n, 1n];
  const exponents = Array(9).fill(0); // length, mass, time, angle; peak, peak to peak, r.m.s., voltage, counts of a vibration
  for (const [i, side] of plainUnit(text.trim()).split("/").entries()) {
    const parts = side.split(/[\s*.()_]+/).filter(Boolean);
    for (const [k, part] of parts.entries()) {
      const [, name, power = "1"] = /^(\D+?|1)(?:\^?(-?\d))?$/.exec(part) ?? [];
      const word = unitWords.get(name?.replace(/\^+$/, ""));
      if (!word) return null;
      const [over, under, ...own] = word;
      // in a header the time behind another word divides too
      const header = k > 0 && k === parts.length - 1 && side.includes("_") && !text.includes("/") && !own[0] && !own[1] && own[2] > 0;
      const sign = i || header ? -Number(power) : Number(power);
      const places = sign > 0 ? [0, 1] : [1, 0];
      for (let count = Math.abs(sign); count > 0; count--) [over, under].forEach((x, at) => (factor[places[at]] = times(factor[places[at]], x)));
      own.forEach((exponent, axis) => (exponents[axis] += sign * exponent));
    }
  }
  return { factor: lowest(factor), exponents };
});
function lowest([over, under]) {
  if (typeof over !== "bigint" || typeof under !== "bigint") return [over, under];
  let [a, b] = [over, under];
  while (b) [a, b] = [b, a % b];
  return [over / a, under / a];
}
function remembered(of) {
  const results = new Map();
  return (text) => {
    if (!results.has(text)) results.set(text, of(text));
    return results.get(text);
  };
}
// the factor of a unit that measures what another one does, to SI or to a unit `into`; null where it does not.
// A radian is a pure number: a torque may be N m/rad.
function factorLike(text, unit, into) {
  const wanted = composed(unit);
  const own = composed(text) ?? composed(text.toLowerCase());
  const pure = (axis) => axis === 3 && (wanted.exponents[0] || wanted.exponents[1]) && !(own.exponents[3] && wanted.exponents[3]);
  if (!own || !wanted || !own.exponents.every((x, axis) => x === wanted.exponents[axis] || pure(axis))) return null;
  if (!into) return own.factor;
  const [[over, under], [by, per]] = [own.factor, composed(into).factor];
  return lowest([over * per, under * by]);
}

// --- numbers -------------------------------------------------------------------------------------------------------------------
// a number with or without its unit in SI and radians, or in a unit `into`; NaN where it is none. A decimal times a power of ten is rounded once.
function typed(text, unit, into) {
  const match = /^\s*([+\-−]?)(\d+[.,]?\d*|[.,]\d+)(?:[eE]([+-]?\d+))?\s*(.*?)\s*$/.exec(text);
  if (!match) return NaN;
  const [, sign, digits, power = "0", own] = match;
  const factor = factorLike(own || unit, unit, into);
  if (!factor) return NaN;
  const minus = sign === "-" || sign === "−" ? -1 : 1;
  const decimal = `${digits.replace(",", ".")}e${power}`;
  const [by, over] = factor;
  if (typeof by !== "bigint" || typeof over !== "bigint") return minus * Number(decimal) * (Number(by) / Number(over));
  return minus * scaled(decimal, by, over);
}
// a decimal number times a ratio of whole numbers, rounded once, as the program reads it
function scaled(decimal, by, over) {
  const ratio = Number(over) / Number(by);
  const shift = Math.round(Math.log10(ratio));
  const [mantissa, power] = decimal.split("e");
  if (10 ** shift === ratio) return Number(`${mantissa}e${Number(power) - shift}`);
  const [whole, part = ""] = mantissa.split(".");
  const tens = Number(power) - part.length;
  if (Math.abs(tens) > 400) return Number(decimal) / ratio;
  const ten = 10n ** BigInt(Math.abs(tens));
  const above = BigInt(whole + part) * by * (tens > 0 ? ten : 1n);
  const below = over * (tens < 0 ? ten : 1n);
  // more bits than a number keeps, and whether anything is left beyond them
  const bits = above.toString(2).length - below.toString(2).length;
  const more = BigInt(Math.max(0, 66 - bits));
  const quotient = (above << more) / below;
  return Number(quotient * below === above << more ? quotient : quotient | 1n) / 2 ** Number(more);
}
// the shortest text that is read back to the same bits
function shortest(x, unit, into) {
  if (!Number.isFinite(x)) return "";
  if (x === 0) return "0";
  const [by, over] = factorLike(unit, unit, into).map(Number);
  const near = unit === "deg" ? x / (Math.PI / 180) : (x * over) / by;
  for (let digits = 1; digits <= 17; digits++) {
    const text = plain(near.toPrecision(digits));
    if (typed(text, unit, into) === x) return text;
  }
  for (const towards of [1, -1]) {
    const text = plain((near * (1 + towards * Number.EPSILON)).toPrecision(17));
    if (typed(text, unit, into) === x) return text;
  }
  return plain(near.toPrecision(unit === "deg" ? 15 : 17));
}
const plain = (text) => String(Number(text));
// a number in 32 digits, of which the shortest text in its unit has all
function digitsOf(x, unit) {
  const [, whole, part = "", power = "0"] = /^(-?\d+)(?:\.(\d+))?(?:e([+-]?\d+))?$/.exec(shortest(x, unit)) ?? [];
  const tens = Number(power) - part.length;
  if (!x || whole === undefined || Math.abs(tens) > 40) return [x, 0];
  const pairOf = (y) => (typeof y === "bigint" ? [Number(y), Number(y - BigInt(Number(y)))] : [y, (y / Math.PI) * PI_REST]);
  const [by, over] = factorLike(unit, unit).map(pairOf);
  const [above, below] = [tens, -tens].map((n) => 10n ** BigInt(Math.max(0, n)));
  return two.div(two.mul(pairOf(BigInt(whole + part) * above), by), two.mul(pairOf(below), over));
}
const PI_REST = 1.2246467991473532e-16; // of π beyond its double: the only factors that are not whole are π and 2π
// a number with those digits alone that two computations agree on
function held(x, error) {
  if (!Number.isFinite(x)) return "–";
  if (x === 0 || !(error > 0)) return Number.isNaN(error) ? short(x) : exact(x);
  const digits = Math.min(17, Math.floor(Math.log10(Math.abs(x) / error)));
  if (digits < 1) return error < 1e-9 ? "0" : "–";
  return digits > 15 ? exact(x) : exact(Number(x.toPrecision(digits)));
}
// a field for a number: `write` takes what was typed, or NaN. Keypads of decimals have no sign and no letters on some phones.
function numberField(parent, name, { unit, into }, signed, write) {
  const input = put(parent, "input", { type: "text", inputmode: signed ? "text" : "decimal", autocapitalize: "off", autocomplete: "off", spellcheck: "false", enterkeyhint: "done", "data-name": name, "aria-label": name });
  input.addEventListener("input", (event) => {
    byHand = event.inputType ? name : "";
    write(typed(input.value, unit, into), input.value);
    byHand = "";
  });
  input.addEventListener("blur", () => (begun = ""));
  input.addEventListener("keydown", (event) => event.stopPropagation());
  return input;
}
// a field with its number of the moment; a wrong entry is marked. False where it stays as it is, for that or because it is typed in
function refreshed(field, name, x) {
  const { input, unit, into } = field;
  if (wrong.has(name)) input.setAttribute("aria-invalid", "true");
  else input.removeAttribute("aria-invalid");
  if (wrong.has(name) || input === document.activeElement) return false;
  if (!Object.is(field.x, x)) Object.assign(field, { x, text: shortest(x, unit, into) });
  if (input.value !== field.text) input.value = field.text;
  return true;
}

// --- undo: `snapshot`, `restore` and `anew` are the page's own ------------------------------------------------------------------
const wrong = new Map(); // entries that are no number: what to say
const past = [];
// why what was entered, as it was written, is no number of its kind; empty where it is one
function refusal(name, x, text, example, positive) {
  if (!text.trim()) return TEXTS.blank(name);
  if (typeof x !== "number" || !Number.isFinite(x)) return TEXTS.wrong(name, text, example);
  if (Math.abs(x) > largest) return TEXTS.large(name, text, largest);
  return positive && x < 0 ? TEXTS.negative(name, text) : "";
}
let begun = ""; // the field whose entry is being typed and stands in `past` as it was before
let byHand = ""; // the field in which a key was pressed just now
function remember() {
  // what is typed key by key is one change
  if (byHand && byHand === begun) return;
  begun = byHand;
  past.push(snapshot());
  if (past.length > 500) past.shift();
}
// changes that are undone together
function asOne(act) {
  [byHand, begun] = [" ", ""];
  act();
  [byHand, begun] = ["", ""];
}
function undo() {
  // a wrong entry changed no number: the one before it comes back
  if (wrong.size) wrong.clear();
  else if (past.length) restore(past.pop());
  begun = "";
}
function listUndo() {
  undoButton.disabled = !past.length && !wrong.size;
}

// --- buttons, and texts to take away --------------------------------------------------------------------------------------
const alertLine = make("p", { id: "alert", role: "alert" });
const tools = make("div", { id: "tools", role: "group" });
const outbox = make("textarea", { id: "outbox", readonly: "", rows: "4", "aria-label": TEXTS.toCopy, hidden: "" });
function say(text) {
  if (alertLine.textContent !== text) alertLine.textContent = text;
}
function tool(text, act) {
  const button = put(tools, "button", { type: "button" }, text);
  button.addEventListener("click", act);
  return button;
}
// a wrong entry leaves nothing to take away, as it leaves no answer
function copied(text) {
  outbox.hidden = !text;
  if (outbox.value !== text) outbox.value = text;
  if (!text) return;
  outbox.select();
  const done = () => {
    say(TEXTS.copied);
    setTimeout(() => alertLine.textContent === TEXTS.copied && say(""), 2000);
  };
  navigator.clipboard?.writeText(text).then(done, () => {});
}
function saved(text, type, suffix) {
  if (!text) return;
  const link = make("a", { href: URL.createObjectURL(new Blob([text], { type })), download: `${document.title.replace(/[^\w-]+/g, "-") || "page"}.${suffix}` });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}
function undone() {
  undo();
  anew();
}
const undoButton = tool(TEXTS.undo, undone);
$("keys").append(`${TEXTS.undoKey}: ${TEXTS.undo}. `);
document.addEventListener("keydown", (event) => {
  // a text that is being typed has an undo of its own
  if (!(event.ctrlKey || event.metaKey) || event.shiftKey || event.key !== "z" || event.target.type?.startsWith("text")) return;
  event.preventDefault();
  undone();
});
