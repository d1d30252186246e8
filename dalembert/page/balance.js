// Rotors with known masses: rows are typed, corrections, states, tolerances and polygons follow.
const tapesOf = sheet.rotors.map((rotor) => Object.fromEntries(Object.entries(tapes[rotor.tapes]).map(([name, tape]) => [name, new Tape(tape)])));
const namesOf = sheet.rotors.map((rotor) => sheet.outputs[rotor.tapes]);
const prefix = (rotor) => (sheet.rotors.length > 1 ? `${rotor.name}/` : "");
const cellName = (rotor, row, column) => `${prefix(rotor)}${row}.${column}`;
let polygons = [];
// to a multiple of a step, ties to the even one; a step such as 0.1 divides by 10, as in the program
function rounded(x, [unit, step]) {
  const even = (y) => (Math.abs(y % 1) === 0.5 ? 2 * Math.round(y / 2) : Math.round(y));
  const inverse = step < 1 ? Math.round(1 / step) : 0;
  return (inverse && Math.abs(inverse * step - 1) < 4e-16 ? even((x / unit) * inverse) / inverse : even(x / unit / step) * step) * unit;
}

// to the nearest mark on a circle whose marks begin at 0, as in the program
function marked(x, [unit, step]) {
  const angle = x / unit;
  const mark = rounded(angle, [1, step]);
  return mark >= 360 || 360 - angle < Math.abs(mark - angle) ? 0 : mark * unit;
}

// the cubics of the mode shapes where a mass stands
function shapesAt(z) {
  const { stations, pieces } = sheet.modes;
  const piece = Math.max(0, Math.min(pieces.length - 1, stations.findLastIndex((station) => station <= z)));
  const entry = { station: stations[piece] };
  pieces[piece].forEach((cubic, k) => cubic.forEach((c, power) => (entry[`shape ${k} ${power}`] = c)));
  return entry;
}
const along = sheet.modes && [sheet.modes.stations[0], sheet.modes.stations.at(-1)];
const rulesOf = (name) => ({ positive: name !== "angle" && name !== "z", within: name === "z" ? along : null });

refusedRows = () => sheet.rotors.flatMap((rotor, r) => sheet.rows[r].map((row) => [values[cellName(rotor, row, sheet.amount)], cellName(rotor, row, "radius")])).filter(([amount, radius]) => amount > 0 && values[radius] === 0).map(([, radius]) => TEXTS.noRadius(radius));

solveSheet = () => {
  polygons = [];
  for (const [r, rotor] of sheet.rotors.entries()) {
    const { mass, result, made } = tapesOf[r];
    const names = namesOf[r];
    const [sums, pairs] = [{}, {}];
    for (const name of names.mass) if (name.startsWith("sum ")) [sums[name], pairs[name]] = [0, [0, 0]];
    const drawn = rotor.planes.map(() => []);
    for (const row of sheet.rows[r]) {
      const entry = { ...sums, radius: 1, z: 0 };
      const exact = {}; // as written: 180° is half a turn
      for (const { name, unit } of sheet.columns) {
        const x = values[cellName(rotor, row, name)];
        const key = name === sheet.amount ? "amount" : name;
        [entry[key], exact[key]] = [x, digitsOf(x, unit)];
      }
      if (sheet.modes) Object.assign(entry, shapesAt(entry.z));
      const out = solved(mass, names.mass, entry, { ...entry, ...exact, ...pairs });
      for (const name of Object.keys(sums)) [sums[name], pairs[name]] = [out.get(name)[0], out.get(name)[2]];
      rotor.planes.forEach((_, p) => drawn[p].push([row, out.get(`share ${p} x`)[0], out.get(`share ${p} y`)[0]]));
    }
    const out = solved(result, names.result, sums, pairs);
    const before = new Map(out);
    if (rotor.made) {
      // the corrections as they are made, and their residual
      const put = {};
      rotor.planes.forEach((_, p) => {
        for (const [name, from] of [["mass", `mass ${p}`], ["radius", `radius ${p}`], ["angle", `plane ${p} angle`]]) {
          const x = out.get(from)[0];
          // a fixed mass stays
          const step = name === "mass" && rotor.fixed[p] ? null : sheet.steps[name];
          put[`${name} ${p}`] = !step ? x : name === "angle" ? marked(whole(x), step) : rounded(x, step);
          if (step) out.set(from, [put[`${name} ${p}`], 0]);
        }
      });
      for (const [name, x] of solved(made, names.made, { ...sums, ...put }, { ...pairs, ...put })) out.set(name, x);
    }
    const set = (name, from, turn = false) => out.has(from) && answers.set(`${prefix(rotor)}${name}`, turn ? turned(out.get(from)) : out.get(from));
    rotor.planes.forEach((plane, p) => {
      set(`${plane}.unbalance`, `plane ${p} size`);
      set(`${plane}.mass`, `mass ${p}`);
      set(`${plane}.angle`, `plane ${p} angle`, true);
      set(`${plane}.radius`, `radius ${p}`);
      polygons.push([`${prefix(rotor)}${plane}`, drawn[p], [out.get(`made ${p} x`)[0], out.get(`made ${p} y`)[0]]]);
    });
    set("static.unbalance", "static size");
    set("static.angle", "static angle", true);
    // rounding of nothing is nothing, as in the program
    const left = (name, from) => {
      const [rest] = out.get(`left ${from}`);
      answers.set(`${prefix(rotor)}residual.${name}`, rest > 1e-12 * out.get(`terms ${from}`)[0] ? out.get(`left ${from}`) : [0, 0]);
    };
    left("static", "static");
    if (sheet.couple) {
      set("couple.unbalance", "couple size");
      set("couple.angle", "couple angle", true);
      // of a plane whose place is not stated there is none
      if (sheet.placed) left("couple", "couple");
    }
    sheet.modes?.names.forEach((name, k) => {
      set(`mode ${name}.unbalance`, `mode ${k} size`);
      set(`mode ${name}.angle`, `mode ${k} angle`, true);
      left(`mode ${name}`, `mode ${k}`);
    });
    rotor.tolerance?.names.forEach((name, p) => answers.set(`${prefix(rotor)}tolerance.${name}`, before.get(`before ${p}`) ?? before.get(`plane ${p} size`)));
  }
};

function build() {
  $("entries").querySelectorAll(".scroll").forEach((one) => one.remove());
  inputs.clear();
  for (const [r, rotor] of sheet.rotors.entries()) {
    const caption = sheet.rotors.length > 1 ? TEXTS.massesOf(rotor.name) : TEXTS.masses;
    const table = grid($("entries"), caption, ["", ...sheet.columns.map((c) => `${TEXTS[c.name]}, ${c.unit}`), ""], { class: "cells" });
    for (const [k, row] of sheet.rows[r].entries()) {
      const line = table.row(row);
      for (const { name, kind, unit } of sheet.columns) cell(put(line, "td"), cellName(rotor, row, name), kind, unit, rulesOf(name));
      const away = put(put(line, "td"), "button", { type: "button", "aria-label": TEXTS.removeRow(row), title: TEXTS.removeRow(row) }, "×");
      away.addEventListener("click", () => {
        remember();
        sheet.rows[r] = sheet.rows[r].filter((other) => other !== row);
        for (const { name } of sheet.columns) {
          wrong.delete(cellName(rotor, row, name));
          delete values[cellName(rotor, row, name)];
        }
        build();
        focusRow(r, Math.min(k, sheet.rows[r].length - 1), "button");
      });
    }
    const add = put(table.box, "button", { type: "button", class: "add" }, TEXTS.addRow);
    add.addEventListener("click", () => {
      remember();
      let k = sheet.rows[r].length + 1;
      const named = /^[A-Za-z]+(?=\d+$)/.exec(sheet.rows[r].at(-1) ?? "")?.[0] ?? "";
      while (sheet.rows[r].includes(`${named}${k}`)) k++;
      sheet.rows[r].push(`${named}${k}`);
      for (const { name } of sheet.columns) values[cellName(rotor, `${named}${k}`, name)] = name === "z" && along ? Math.max(along[0], Math.min(along[1], 0)) : 0;
      build();
      focusRow(r, sheet.rows[r].length - 1, "input");
    });
  }
  update();
}

// the keyboard goes on where it was: in a row of a rotor's table, or at the button below a table without rows
function focusRow(r, k, what) {
  const box = $("entries").querySelectorAll(".scroll")[r];
  (box.querySelectorAll("tbody tr")[k]?.querySelector(what) ?? box.querySelector(".add")).focus({ preventScroll: true });
}

drawSheet = () => {
  const host = $("answers");
  host.replaceChildren();
  const [mass, unbalance] = [sheet.shown.mass, sheet.shown.unbalance];
  answerTable(
    host,
    sheet.remove ? TEXTS.toRemove : TEXTS.toAdd,
    ["", `${TEXTS.mass}, ${mass.unit}`, `${TEXTS.angle}, deg`, `${TEXTS.unbalance}, ${unbalance.unit}`, ...(sheet.sought ? [`${TEXTS.radius}, ${sheet.shown.radius.unit}`] : [])],
    sheet.rotors.flatMap((rotor) => rotor.planes.map((plane) => [`${prefix(rotor)}${plane}`, ...shownVector(`${prefix(rotor)}${plane}.`, "mass", mass.si, "angle"), shownAnswer(`${prefix(rotor)}${plane}.unbalance`, unbalance.si), ...(sheet.sought ? [shownAnswer(`${prefix(rotor)}${plane}.radius`, sheet.shown.radius.si)] : [])])),
  );
  answerTable(
    host,
    TEXTS.state,
    ["", TEXTS.before, `${TEXTS.angle}, deg`, TEXTS.after],
    sheet.rotors.flatMap((rotor) => [["static", unbalance], ...(sheet.couple ? [["couple", sheet.shown.couple]] : [])].map(([kind, { unit, si }]) => [
      `${prefix(rotor)}${TEXTS[kind]}, ${unit}`,
      ...shownVector(`${prefix(rotor)}${kind}.`, "unbalance", si, "angle"),
      shownAnswer(`${prefix(rotor)}residual.${kind}`, si),
    ])),
  );
  if (sheet.modes) {
    answerTable(
      host,
      `${TEXTS.modalSums}, ${unbalance.unit}`,
      [TEXTS.mode, TEXTS.before, `${TEXTS.angle}, deg`, TEXTS.after],
      sheet.rotors.flatMap((rotor) => sheet.modes.names.map((name) => [`${prefix(rotor)}${name}`, ...shownVector(`${prefix(rotor)}mode ${name}.`, "unbalance", unbalance.si, "angle"), shownAnswer(`${prefix(rotor)}residual.mode ${name}`, unbalance.si)])),
    );
  }
  if (sheet.rotors.some((rotor) => rotor.tolerance)) {
    answerTable(
      host,
      `${TEXTS.tolerance}, ${unbalance.unit}`,
      ["", TEXTS.permissible, TEXTS.before, ""],
      sheet.rotors.flatMap((rotor) => (rotor.tolerance?.names ?? []).map((name, p) => {
        const [limit, x] = [rotor.tolerance.permissible[p], answer(`${prefix(rotor)}tolerance.${name}`)];
        return [`${prefix(rotor)}${name}`, short(limit / unbalance.si), shownAnswer(`${prefix(rotor)}tolerance.${name}`, unbalance.si), Number.isFinite(x) ? (x <= limit ? TEXTS.within : TEXTS.beyond) : "–"];
      })),
    );
  }
  const drawn = put(host, "div", { class: "polygons" });
  if (answers.size) for (const [name, vectors, closing] of polygons.slice(0, 8)) polygon(drawn, TEXTS.polygon(name), vectors, closing, TEXTS.correction);
};

function csv() {
  if (!answers.size) return "";
  const several = sheet.rotors.length > 1;
  const lines = [[...(several ? ["rotor"] : []), "name", ...sheet.columns.map((c) => c.header)].join(",")];
  for (const [r, rotor] of sheet.rotors.entries()) {
    for (const row of sheet.rows[r]) lines.push([...(several ? [quoted(rotor.name)] : []), quoted(row), ...sheet.columns.map((c) => inUnit(values[cellName(rotor, row, c.name)], c.unit))].join(","));
  }
  return `${lines.join("\n")}\n`;
}
const settable = () => sheet.rotors.flatMap((rotor, r) => sheet.rows[r].flatMap((row) => sheet.columns.map((c) => cellName(rotor, row, c.name))));

window.dalembert = {
  get names() {
    return settable();
  },
  set(changed) {
    const unknown = Object.keys(changed).find((name) => !settable().includes(name));
    if (unknown !== undefined) {
      say(TEXTS.unknown(unknown));
      return false;
    }
    asOne(() => Object.entries(changed).forEach(([name, x]) => check(name, x, String(x), inputs.get(name).rules)));
    update();
    return answers.size > 0;
  },
  get: (name) => (settable().includes(name) ? (wrong.has(name) ? NaN : values[name]) : answer(name)),
  curve: () => [],
  options: () => "",
  toml: () => "",
  csv,
};
start();
