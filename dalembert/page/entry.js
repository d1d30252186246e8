// Numbers that are typed, with their units; numbers that are shown, with the digits that hold.
const plainUnit = (unit) => unit.replace(/per/g, "").replace(/[\s_/·^*.]/g, "").replace("°", "deg").replace("²", "2").replace("³", "3").replace("µ", "u");

// a number with or without its unit in SI and radians; NaN where it is none. A decimal times a power of ten is rounded once.
function typed(text, units, unit) {
  const found = /^\s*([+\-−]?)(\d+[.,]?\d*|[.,]\d+)(?:[eE]([+-]?\d+))?\s*(.*?)\s*$/.exec(text);
  if (!found) return NaN;
  const [, sign, digits, power = "0", own] = found;
  const name = own === "" ? unit : Object.keys(units ?? {}).find((each) => plainUnit(each) === plainUnit(own));
  if (own !== "" && name === undefined) return NaN;
  const mantissa = `${sign === "-" || sign === "−" ? "-" : ""}${digits.replace(",", ".")}`;
  const [by, over] = units?.[name] ?? [1, 1];
  if (name === "deg") return Number(`${mantissa}e${power}`) * (Math.PI / 180);
  const shift = Math.round(Math.log10(over / by));
  if (10 ** shift === over / by) return Number(`${mantissa}e${Number(power) - shift}`);
  return (Number(`${mantissa}e${power}`) * by) / over;
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
  if (x === 0 || !(error > 0)) return error === undefined ? short(x) : exact(x);
  const digits = Math.min(17, Math.floor(Math.log10(Math.abs(x) / error)));
  if (digits < 1) return error < 1e-9 ? "0" : "–";
  return digits > 15 ? exact(x) : exact(Number(x.toPrecision(digits)));
}
function say(text) {
  $("alert").textContent = text;
}
// a field for a number: `read` gives what is shown, `write` takes what was typed, or NaN
function numberField(parent, name, label, units, unit, write) {
  const input = put(parent, "input", { type: "text", inputmode: "decimal", autocomplete: "off", spellcheck: "false", "data-name": name, "aria-label": label });
  input.addEventListener("input", () => {
    const x = typed(input.value, units, unit);
    input.setAttribute("aria-invalid", Number.isNaN(x));
    write(x, input.value);
  });
  input.addEventListener("keydown", (event) => event.stopPropagation());
  return input;
}
