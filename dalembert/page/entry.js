// Numbers that are typed, with their units; numbers that are shown, with the digits that hold.
const plainUnit = (unit) => unit.replace(/per/g, "").replace(/[\s_/·^*.]/g, "").replace("°", "deg").replace("²", "2").replace("³", "3").replace("µ", "u");

// a number with or without its unit in SI and radians; NaN where it is none. A decimal times a power of ten is rounded once.
function typed(text, units, unit) {
  const found = /^\s*([+\-−]?)(\d+[.,]?\d*|[.,]\d+)(?:[eE]([+-]?\d+))?\s*(.*?)\s*$/.exec(text);
  if (!found) return NaN;
  const [, sign, digits, power = "0", own] = found;
  const name = own === "" ? unit : Object.keys(units ?? {}).find((each) => plainUnit(each) === plainUnit(own));
  if (own !== "" && name === undefined) return NaN;
  const minus = sign === "-" || sign === "−" ? -1 : 1;
  const decimal = `${digits.replace(",", ".")}e${power}`;
  const [by, over] = units?.[name] ?? [1, 1];
  if (over === 1) return minus * Number(decimal) * by;
  if (!Number.isInteger(by) || !Number.isInteger(over)) return minus * Number(decimal) * (by / over);
  return minus * scaled(decimal, by, over);
}
// a decimal number times a ratio of whole numbers, rounded once, as the program reads it
function scaled(decimal, by, over) {
  const shift = Math.round(Math.log10(over / by));
  const [mantissa, power] = decimal.split("e");
  if (10 ** shift === over / by) return Number(`${mantissa}e${Number(power) - shift}`);
  const [whole, part = ""] = mantissa.split(".");
  const tens = Number(power) - part.length;
  if (Math.abs(tens) > 400) return (Number(decimal) * by) / over;
  const ten = 10n ** BigInt(Math.abs(tens));
  const above = BigInt(whole + part) * BigInt(by) * (tens > 0 ? ten : 1n);
  const below = BigInt(over) * (tens < 0 ? ten : 1n);
  // more bits than a number keeps, and whether anything is left beyond them
  const bits = above.toString(2).length - below.toString(2).length;
  const more = BigInt(Math.max(0, 66 - bits));
  const quotient = (above << more) / below;
  return Number(quotient * below === above << more ? quotient : quotient | 1n) / 2 ** Number(more);
}
// the shortest text that is read back to the same bits
function shortest(x, units, unit) {
  if (!Number.isFinite(x)) return "";
  if (x === 0) return "0";
  const [by, over] = units?.[unit] ?? [1, 1];
  const near = unit === "deg" ? x / (Math.PI / 180) : (x * over) / by;
  for (let digits = 1; digits <= 17; digits++) {
    const text = plain(near.toPrecision(digits));
    if (typed(text, units, unit) === x) return text;
  }
  for (const towards of [1, -1]) {
    const text = plain((near * (1 + towards * Number.EPSILON)).toPrecision(17));
    if (typed(text, units, unit) === x) return text;
  }
  return plain(near.toPrecision(unit === "deg" ? 15 : 17));
}
const plain = (text) => String(Number(text));
// a number with those digits alone that two computations agree on
function held(x, error) {
  if (!Number.isFinite(x)) return "–";
  if (x === 0 || !(error > 0)) return Number.isNaN(error) ? short(x) : exact(x);
  const digits = Math.min(17, Math.floor(Math.log10(Math.abs(x) / error)));
  if (digits < 1) return error < 1e-9 ? "0" : "–";
  return digits > 15 ? exact(x) : exact(Number(x.toPrecision(digits)));
}
// a field for a number: `write` takes what was typed, or NaN. Keypads of decimals have no sign and no letters on some phones.
function numberField(parent, name, units, unit, signed, write) {
  const input = put(parent, "input", { type: "text", inputmode: signed ? "text" : "decimal", autocapitalize: "off", autocomplete: "off", spellcheck: "false", enterkeyhint: "done", "data-name": name, "aria-label": name });
  input.addEventListener("input", (event) => {
    byHand = event.inputType ? name : "";
    write(typed(input.value, units, unit), input.value);
    byHand = "";
  });
  input.addEventListener("blur", () => (begun = ""));
  input.addEventListener("keydown", (event) => event.stopPropagation());
  return input;
}
// a field with its number of the moment; a wrong entry is marked. False where it stays as it is, for that or because it is typed in
function refreshed(field, name, x) {
  const { input, units, unit } = field;
  if (wrong.has(name)) input.setAttribute("aria-invalid", "true");
  else input.removeAttribute("aria-invalid");
  if (wrong.has(name) || input === document.activeElement) return false;
  if (!Object.is(field.x, x)) Object.assign(field, { x, text: shortest(x, units, unit) });
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
  outbox.value = text;
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
