// A mechanism that is computed anew: its tapes with the numbers of the moment. No formula of mechanics stands here.
const SERIES = [0.03, 0.16, 14]; // near a change point quantities are interpolated: how near, rad; from poses over how far, rad; how many
const SLIDES = [1, 2, 4]; // sizes of the mechanism within which the limits of a slide are looked for

class Machine extends Way {
  // what does not change along the input
  #fixed(numbers) {
    const entering = { ...numbers };
    for (const [j, input] of this.model.inputs.entries()) {
      for (const [k, name] of ["v", "a", "j"].entries()) {
        const path = input.paths[k + 1];
        entering[`${name}${j}`] = path && numbers[path] !== this.own[path] ? numbers[path] : this.rates[j][k];
      }
    }
    if (this.time) entering.time = this.time;
    return entering;
  }

  // the inputs of the guess
  #start(numbers) {
    return this.model.inputs.map((input) => (input.follows && input.paths[0] ? numbers[input.paths[0]] : input.at));
  }

  // how each loop closes at the guess: signs and unknowns in `entering`, which has the dimensions; says whether it can be so at all
  #choose(entering, at) {
    at.forEach((q, j) => (entering[`q${j}`] = q));
    for (const g of this.iterated) g.start.forEach((x, i) => (entering[`x ${g.name} ${i}`] = x));
    for (const g of this.closed) entering[`sign ${g.name}`] = g.sign;
    for (const body of this.winding) entering[`near ${body}`] = NaN;
    // the constants of gears follow from what is placed so far
    const choose = () => {
      const choice = this.tapes.choice.one(entering);
      this.model.phases.forEach((i, k) => (entering[`phase ${i}`] = choice[5 * this.closed.length + k]));
      return choice;
    };
    let choice = choose();
    for (const g of this.model.groups) {
      if (g.start) {
        if (!this.#assemble(g, entering)) return (entering.open = g.name) && false;
        choice = choose();
        continue;
      }
      const k = 5 * this.closed.indexOf(g);
      const margin = choice[k];
      // two assemblies meet there: the one it was before
      entering[`sign ${g.name}`] = Math.abs(margin) < 1e-14 || !Number.isFinite(choice[k + 4]) ? g.sign : choice[k + 4];
      for (const body of g.winds) entering[`near ${body}`] = principal(this.tapes.winds.one(entering)[this.winding.indexOf(body)]);
    }
    return !(choice[choice.length - 1] <= 0);
  }

  // the unknowns of an iterated group: iterated from the guess; where that does not close, the nearest of many assemblies
  #assemble(g, entering) {
    const says = this.tapes.guessed.one(entering).subarray(g.guess);
    const put = (x) => g.keys.forEach((key, i) => (entering[key] = x[i]));
    if (g.sure) {
      const x = Array.from(says.subarray(0, g.start.length));
      const wide = 1 + g.free.length;
      const rows = Array.from({ length: g.rows }, (_, row) => says.subarray(g.start.length + row * wide, g.start.length + (row + 1) * wide));
      const slides = leastSquares(g.free.map((_, k) => rows.map((row) => row[1 + k])), rows.map((row) => row[0]));
      g.free.forEach((i, k) => (x[i] = slides[k]));
      put(x);
      if (this.iterate(g, entering)) return true;
    }
    let [least, best, others] = [Infinity, null, false];
    for (const start of spread(g, this.model.size)) {
      put(start);
      if (!this.iterate(g, entering)) continue;
      const far = this.tapes.guessed.one(entering)[g.guess + g.start.length + g.rows * (1 + g.free.length)];
      const x = g.keys.map((key) => entering[key]);
      others ||= best !== null && x.some((y, i) => (i < g.angles ? Math.hypot(Math.cos(y) - Math.cos(best[i]), Math.sin(y) - Math.sin(best[i])) : Math.abs(y - best[i]) / this.model.size) >= 1e-6);
      if (far < least) [least, best] = [far, x];
    }
    // the guess says nothing of it, and there are several
    if (!best || (others && !g.informed)) return false;
    put(best);
    return true;
  }

  // what places enter by at inputs, one array for each input of the mechanism; `pose`: with its rates
  #closing(state, inputs, pose) {
    const entering = { ...state.fixed };
    if (pose !== undefined) Object.assign(entering, lane(entering, pose));
    inputs.forEach((q, j) => (entering[`q${j}`] = q));
    const [q] = inputs;
    for (const g of this.closed) entering[`sign ${g.name}`] = this.one ? this.signs(state, g, q) : state.fixed[`sign ${g.name}`];
    if (this.one) this.turned(state, entering, q);
    if (this.iterated.length && this.one) {
      for (const g of this.iterated) {
        const keys = g.start.map((_, i) => `x ${g.name} ${i}`);
        for (const key of keys) entering[key] = this.between(state, key, q);
        for (let round = 0; round < 3; round++) {
          const out = this.tapes.steps.run(entering, q.length);
          const bad = q.map((_, l) => (out[g.place][l] < 0.1 * this.model.size ? 0 : NaN));
          keys.forEach((key, i) => (entering[key] = out[g.place + 1 + i].map((x, l) => x + bad[l])));
        }
        // a loop that stays open is not assembled
        const open = this.tapes.steps.run(entering, q.length)[g.place];
        keys.forEach((key) => (entering[key] = entering[key].map((x, l) => (open[l] <= 1e-11 * this.model.size ? x : NaN))));
      }
    } else if (this.iterated.length + this.winding.length && !this.one) this.#alongLines(state, entering, inputs);
    return entering;
  }

  // all that enters the tapes at inputs
  #entering(state, inputs, pose) {
    const entering = this.#closing(state, inputs, pose);
    if (this.tapes.twists) this.#wind(state, entering, inputs);
    if (this.tapes.over && pose === undefined) this.#load(entering, this.tapes.over.run(entering, inputs[0].length));
    if (!this.tapes.over || pose === undefined) {
      const locked = this.#settle(entering, inputs[0].length);
      if (pose === undefined) state.locked = new Set(locked);
    }
    return entering;
  }

  // what the forces of n lanes depend on and tapes compute; where friction locks the joints
  #settle(entering, n) {
    if (this.tapes.statics) this.#bear(entering, n);
    if (!this.rubbing) return [];
    this.tapes.slips.run(entering, n).forEach((slip, k) => (entering[`slip ${k}`] = slip));
    return this.rubbing.fit(entering, n);
  }

  // the equations of all links at one lane of the tape's outputs
  #system(out, l) {
    const { count, rows, places } = this.model.statics;
    const a = Array.from({ length: rows }, () => new Array(count + 1).fill(0));
    places.forEach(([row, column], k) => (a[row][column] = out[k][l]));
    return [a, a.map((row) => row[count])];
  }

  // redundant statics: the forces that it determines enter the tape of the poses
  #bear(entering, n) {
    const { count } = this.model.statics;
    const out = this.tapes.statics.run(entering, n);
    const forces = Array.from({ length: count }, () => new Float64Array(n));
    for (let l = 0; l < n; l++) determined(...this.#system(out, l), count).forEach((x, i) => (forces[i][l] = x));
    forces.forEach((x, i) => (entering[`f ${i}`] = x));
  }

  // by how much the forces of a lane are off, as 32 digits show: what they leave of the equations, solved once more
  #unbalanced(here) {
    const { count, places } = this.model.statics;
    const exact = this.tapes.statics.twice(here);
    const rest = [];
    places.forEach(([row, column], k) => {
      const f = column < count ? here[`f ${column}`] || 0 : 1;
      rest[row] = two.add(rest[row] ?? [0, 0], two.mul(exact[k], [f, 0]));
    });
    const [a] = this.#system(exact.map(([high]) => [high]), 0);
    return determined(a, Array.from(rest, (x) => x?.[0] ?? 0), count);
  }

  // several inputs: every pose on its own straight line from the guess
  #alongLines(state, entering, inputs) {
    const n = inputs[0].length;
    const keys = this.iterated.flatMap((g) => g.keys);
    const near = this.winding.map((body) => `near ${body}`);
    const reached = [...keys, ...near].map(() => new Float64Array(n).fill(NaN));
    for (let l = 0; l < n; l++) {
      const way = inputs.map((q, j) => q[l] - state.at[j]);
      const here = { ...state.fixed };
      let [gone, step] = [0, 1 / Math.max(1, Math.ceil(Math.max(...way.map(Math.abs)) / 0.1))];
      const [first, least] = [step, step / 2 ** 20];
      while (gone < 1 && step > least) {
        const to = Math.min(1, gone + step);
        const trial = { ...here };
        way.forEach((d, j) => (trial[`q${j}`] = state.at[j] + to * d));
        const closes = this.model.groups.every((g) => (g.start ? this.iterate(g, trial, 8) : this.#turns(g, here, trial)));
        if (closes && keys.every((key) => Math.abs(trial[key] - here[key]) < 0.3 * Math.max(1, Math.abs(here[key])))) {
          Object.assign(here, trial);
          gone = to;
          step = near.length ? Math.min(2 * step, first) : 2 * step;
        } else step /= 2;
      }
      if (gone >= 1) [...keys, ...near].forEach((key, k) => (reached[k][l] = here[key]));
    }
    [...keys, ...near].forEach((key, k) => (entering[key] = reached[k]));
    // a pose that is not reached has no number of turns, and is not assembled
    for (const g of this.closed) for (const body of g.winds) {
      const sign = entering[`sign ${g.name}`];
      entering[`sign ${g.name}`] = entering[`near ${body}`].map((x) => (Number.isFinite(x) ? sign : NaN));
    }
  }

  // the whole turns of a group's links a step farther on; returns whether they can be counted there
  #turns(g, here, trial) {
    return g.winds.every((body) => {
      const key = `near ${body}`;
      const turned = this.tapes.winds.one(trial)[this.winding.indexOf(body)] - here[key];
      trial[key] = here[key] + turned - TAU * Math.round(turned / TAU);
      return Math.abs(trial[key] - here[key]) <= FAR;
    });
  }

  // the whole turns of torsion springs, followed from the guess
  #wind(state, entering, inputs) {
    const [q] = inputs;
    const within = this.tapes.twists.run(entering, q.length);
    for (const [s, turns] of this.model.springs.entries()) {
      const near = within[s].map((x, l) => {
        if (!this.one || !state.twists) return x;
        const values = state.twists[s];
        const place = Math.round((q[l] - state.grid[0]) / (state.grid[1] - state.grid[0]));
        const followed = values[Math.min(Math.max(place, 0), values.length - 1)];
        return x + TAU * Math.round((followed - x) / TAU);
      });
      entering[`near spring ${s}`] = near.map((x) => x + TAU * turns);
    }
  }

  // the forces that tables give, of what they are over
  #load(entering, over) {
    for (const [i, table] of this.model.tables.entries()) {
      entering[`table ${i} x`] = tabled(table, table.x, over[i]);
      entering[`table ${i} y`] = tabled(table, table.y, over[i]);
    }
  }

  // all poses of the sweep and one more, the free one: numbers by their paths, the inputs of the free pose
  solve(numbers, free) {
    const [fixed, at] = [this.#fixed(numbers), this.#start(numbers)];
    const inputs = this.sweep.map((q, j) => Float64Array.of(...q, free[j]));
    const state = { fixed, at, inputs, flips: new Map(), limits: [], unknowns: new Map(), numbers };
    state.chosen = Object.values(numbers).every(Number.isFinite) && this.#choose(fixed, at);
    if (!state.chosen) return state;
    if (this.one) {
      const ends = [...inputs[0].filter(Number.isFinite), ...(this.model.fine?.slice(0, 2) ?? [])];
      this.look(state, Math.min(at[0], ends.reduce((a, b) => Math.min(a, b), Infinity)), Math.max(at[0], ends.reduce((a, b) => Math.max(a, b), -Infinity)));
    }
    state.entering = this.#entering(state, inputs);
    const out = this.tapes.pose.run(state.entering, this.n + 1);
    if (this.one && state.flips.size) this.#through(state, out);
    state.closed = out.pop();
    state.rows = out;
    return state;
  }

  // the paths of points where the sweep has too few poses to draw them, x and y of each by its name
  paths(state) {
    const [low, high, count] = this.model.fine;
    const q = Float64Array.from({ length: count }, (_, i) => low + ((high - low) * i) / (count - 1));
    const out = this.tapes.paths.run(this.#closing(state, [q], 0), count);
    const closed = out.pop();
    for (const row of out) for (let l = 0; l < count; l++) if (!Number.isFinite(closed[l])) row[l] = NaN;
    return new Map(this.model.traced.map((name, k) => [name, [out[2 * k], out[2 * k + 1]]]));
  }

  // poses near a change point: a polynomial through poses on both sides
  #through(state, out) {
    const [q] = state.inputs;
    const [reach, span, count] = SERIES;
    const unit = state.turn / TAU;
    const every = [...state.flips.values()].flat();
    state.interpolated = new Set();
    for (const flip of every) {
      const near = [];
      for (let l = 0; l < q.length; l++) if (Math.abs(q[l] - flip) < reach * unit) near.push(l);
      if (!near.length) continue;
      const apart = Math.min(...every.map((f) => Math.abs(f - flip)).filter((d) => d > 1e-6 * unit), 2 * span * unit);
      const half = Math.min(span * unit, 0.45 * apart);
      const angles = Array.from({ length: count }, (_, k) => (Math.PI * (k + 0.5)) / count);
      const nodes = Float64Array.from(angles, (t) => flip + half * Math.cos(t));
      const weights = angles.map((t, k) => (k % 2 ? -1 : 1) * Math.sin(t));
      // how little of a row is in the last of its Chebyshev terms, where the row is smooth
      const rough = (row) => {
        const tail = (order) => Math.abs(row.reduce((sum, y, k) => sum + y * Math.cos(order * angles[k]), 0));
        return Math.max(tail(count - 1), tail(count - 2)) / Math.max(...row.map(Math.abs));
      };
      const between = (row, l, turns) => {
        if (turns) for (let k = 1; k < count; k++) row[k] += TAU * Math.round((row[k - 1] - row[k]) / TAU);
        // a joint force may grow without end there: then it is the force times the way to there that is smooth
        let power = 0;
        for (let [least, p, y] = [rough(row), 1, row]; p <= 2 && least > 1e-10; p++) {
          y = y.map((x, k) => x * (nodes[k] - flip));
          const next = rough(y);
          if (next < 0.01 * least) [least, power, row] = [next, p, y];
        }
        let [sum, total] = [0, 0];
        let exact = -1;
        for (let k = 0; k < count; k++) {
          const d = q[l] - nodes[k];
          if (d === 0) exact = k;
          sum += (weights[k] / d) * row[k];
          total += weights[k] / d;
        }
        const x = (exact < 0 ? sum / total : row[exact]) / (q[l] - flip) ** power;
        return turns ? x - TAU * Math.round(x / TAU) : Number.isFinite(x) ? x : NaN;
      };
      // the rates and the loads of a pose that has its own are kept at all nodes, and what is interpolated is smooth
      const lanes = this.tapes.over || Object.values(state.fixed).some((x) => typeof x !== "number") ? near.map((l) => [l]) : [near];
      // near the change point the closed forms lose digits: the nodes are computed with 32
      const precise = (tape, entering) => {
        const each = Array.from(nodes, (_, k) => tape.twice(lane(entering, k)));
        return tape.outputs.map((_, r) => Float64Array.from(each, (row) => row[r][0]));
      };
      for (const poses of lanes) {
        const entering = this.#entering(state, [nodes], poses[0]);
        if (this.tapes.over) {
          const over = precise(this.tapes.over, entering);
          this.#load(entering, over.map((row, i) => [between(row, poses[0], this.model.tables[i].turns)]));
          for (const [name, x] of Object.entries(entering)) if (name.startsWith("table ")) entering[name] = x[0];
          this.#settle(entering, count);
        }
        const values = precise(this.tapes.pose, entering);
        if (!values.every((row) => row.every(Number.isFinite))) continue;
        for (const [r, row] of values.entries()) {
          for (const l of poses) {
            out[r][l] = between(row, l, this.angleRows.has(r));
            state.interpolated.add(l);
          }
        }
      }
    }
  }

  // the limits of the input over the turn from the guess: [input, side on which it is assembled, group]; of a slide those around it
  limits(numbers) {
    const [fixed, at] = [this.#fixed(numbers), this.#start(numbers)];
    const state = { fixed, at, flips: new Map(), limits: [], unknowns: new Map(), numbers };
    if (!this.one || !this.#choose(fixed, at)) return [];
    const [start] = at;
    if (!this.model.inputs[0].slides) {
      this.look(state, this.iterated.length ? start - TAU : start, start + TAU);
      return state.limits.sort((a, b) => a[0] - b[0]);
    }
    let around = [];
    for (const reach of SLIDES) {
      this.look(state, start - reach * this.model.size, start + reach * this.model.size);
      const ends = state.limits.sort((a, b) => a[0] - b[0]);
      around = [ends.findLast(([q, side]) => side > 0 && q < start), ends.find(([q, side]) => side < 0 && q > start)].filter(Boolean);
      if (around.length === 2) break;
    }
    return around;
  }

  // the first loop of a pose that does not close, and by how much, m; null where no tape has it
  short(state, l) {
    if (!state.chosen) return null;
    const out = this.tapes.short.one(lane(state.entering, l));
    const names = this.model.groups.filter((g) => !g.start).map((g) => g.name);
    for (const [k, by] of out.entries()) if (by > 0) return [names[k] ?? "", by];
    return null;
  }

  // how far the rows of a pose are from the same operations in 32 digits; `exactly` has the digits of a number of a kind
  errors(state, l, exactly = (x) => [x, 0]) {
    if (state.interpolated?.has(l)) return null;
    const here = lane(state.entering, l);
    const exact = Object.fromEntries([...this.kinds].map(([path, kind]) => [path, exactly(here[path], kind)]));
    const inputs = (from) => Object.fromEntries(this.model.inputs.map(({ slides }, j) => [`q${j}`, exactly(from[`q${j}`], slides ? "length" : "angle")]));
    if (this.model.phases.length) {
      const chosen = this.tapes.choice.twice({ ...state.fixed, ...exact, ...inputs(state.fixed) }).slice(5 * this.closed.length);
      this.model.phases.forEach((i, k) => (exact[`phase ${i}`] = chosen[k]));
    }
    Object.assign(exact, inputs(here));
    if (this.tapes.statics) this.#unbalanced({ ...here, ...exact }).forEach((x, i) => (exact[`f ${i}`] = [here[`f ${i}`], x || 0]));
    if (this.rubbing) Object.assign(exact, this.rubbing.refined(here, exact));
    const twice = this.tapes.pose.twice({ ...here, ...exact });
    return twice.slice(0, -1).map(([high, low], r) => Math.abs(high - state.rows[r][l] + low));
  }

  // a quantity as a function of the pose, SI and radians
  quantity(state, { row, less, turns, order, zero, locks }) {
    if (!state.rows || (order && !zero && !this.moves(state))) return () => NaN;
    const [closed, values, others] = [state.closed, state.rows[row], state.rows[less]];
    return (l) => {
      if (!Number.isFinite(closed[l])) return NaN;
      if (zero) return 0;
      if (locks && state.locked.has(l)) return NaN;
      const x = others ? values[l] - others[l] : values[l];
      return turns && x < 0 ? (x + TAU < TAU ? x + TAU : 0) : x + 0;
    };
  }

  // whether there are rates: the file has a speed, be it zero, or something moves
  moves(state) {
    return this.model.inputs.some(({ rated }, j) => rated || ["v", "a", "j"].some((name) => state.fixed[`${name}${j}`]));
  }

  // the numbers of the drawing that follow from the dimensions
  drawn(state) {
    return this.tapes.drawn.one(state.fixed);
  }

  // the points of a cam's profile, some on each piece of its law: their x, and their y
  profile(state, k) {
    const { counts } = this.model.cams[k];
    const places = counts.flatMap((count, piece) => Array.from({ length: count }, (_, j) => [piece, j / count]));
    const [piece, share] = [0, 1].map((i) => Float64Array.from(places, (place) => place[i]));
    return this.tapes[`cam${k}`].run({ ...state.fixed, piece, share }, places.length);
  }
}

// --- the numbers of the moment ------------------------------------------------------------------------------------------
let machine, numbers, freePose, state;
function begin(data) {
  machine = new Machine(data.model, tapes);
  [numbers, freePose] = [{ ...machine.own }, data.model.first.slice()];
  const [series] = data.series;
  recompute(series);
  // the original, as a ghost where numbers have changed
  const columns = series.columns.map((c) => ({ ...c, values: c.values.slice() }));
  const points = series.points.map((p) => ({ ...p }));
  const { shapes, bodies } = structuredClone({ shapes: series.shapes, bodies: series.bodies });
  data.series.push({ ...series, columns, points, shapes, bodies, name: TEXTS.original, hidden: () => !changes().length });
}
const changes = () => Object.keys(numbers).filter((path) => !Object.is(numbers[path], machine.own[path]));
function recompute(series) {
  state = wrong.size ? { chosen: false } : machine.solve(numbers, freePose);
  for (const column of series.columns) {
    const si = column.si ?? 1;
    // what one of a unit is in SI, or how many of it make one: the one of them that is a whole number is exact
    const many = Math.round(1 / si);
    const whole = si < 1 && Math.abs(many * si - 1) < 1e-15;
    const at = "input" in column ? (l) => (l < machine.n ? machine.sweep[column.input][l] : freePose[column.input]) : machine.quantity(state, column);
    for (let l = 0; l <= machine.n; l++) column.values[l] = whole ? at(l) * many : at(l) / si;
  }
  const paths = machine.tapes.paths && state.rows ? machine.paths(state) : null;
  for (const point of series.points) point.path = paths?.get(point.name);
  if (!state.rows) return;
  redraw(machine, state, series);
}
// the numbers of the drawing, in its shapes, bodies and labels
function redraw(machine, state, series) {
  const drawn = machine.drawn(state);
  for (const [k, { shape }] of machine.model.cams.entries()) {
    const [x, y] = machine.profile(state, k);
    series.shapes[shape].p = Array.from(x).flatMap((u, l) => [u, y[l]]);
  }
  for (const [i, what, first, row, count] of machine.model.drawn) {
    if (what === "s") series.shapes[i].s = drawn[row];
    else {
      const place = what === "label" ? series.labels[i].z : what === "at" ? series.bodies[i].at : series.shapes[i][what];
      for (let k = 0; k < count; k++) place[first + k] = drawn[row + k];
    }
  }
}
