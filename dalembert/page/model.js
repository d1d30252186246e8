// A mechanism that is computed anew: its tapes with the numbers of the moment. No formula of mechanics stands here; what is done is
// the choice of each loop's assembly, the look along the input for places where a radicand touches or crosses zero, and iteration.
const TAU = 2 * Math.PI;
const TOUCHES = 1e-13; // a radicand so small is zero but for rounding
const DIP = 0.05; // a radicand below this may touch zero between two samples
const PER_TURN = 720; // samples of a turn
const SERIES = [0.03, 0.16, 14]; // rad: beside a change point the quantities are interpolated, over so far, from so many poses

class Machine {
  constructor(model, tapes) {
    this.model = model;
    this.tapes = Object.fromEntries(Object.entries(tapes).map(([name, tape]) => [name, new Tape(tape)]));
    this.kinds = new Map(model.dimensions.map(([path, kind]) => [path, kind]));
    this.own = Object.fromEntries(model.dimensions.map(([path, , value]) => [path, value]));
    this.n = model.n;
    this.sweep = model.inputs.map((input) => unpack(input.sweep, model.n));
    this.one = model.inputs.length === 1;
    this.closed = model.groups.filter((g) => !g.start);
    this.iterated = model.groups.filter((g) => g.start);
    let place = 0;
    for (const g of this.iterated) {
      g.place = place;
      place += 1 + g.start.length;
    }
    this.angleRows = new Set();
    for (const q of Object.values(model.quantities)) if (q.turns) this.angleRows.add(q.row);
  }

  // what does not change along the input
  #given(numbers) {
    const given = { ...numbers };
    for (const [j, input] of this.model.inputs.entries()) {
      for (const [k, name] of ["v", "a", "j"].entries()) {
        const path = input.paths[k + 1];
        given[`${name}${j}`] = path && numbers[path] !== this.own[path] ? numbers[path] : input.rates[k];
      }
    }
    return given;
  }

  // the inputs of the guess
  #start(numbers) {
    return this.model.inputs.map((input) => (input.follows && input.paths[0] ? numbers[input.paths[0]] : input.at));
  }

  // Newton's method on the steps of a tape: the unknowns of a group in `given`; says whether its loops close
  #iterate(group, given, limit = 60) {
    const { name, start, angles, place } = group;
    const count = start.length;
    const keys = start.map((_, i) => `x ${name} ${i}`);
    const tape = this.tapes.steps;
    let out = tape.one(given);
    const size = this.model.size;
    for (let round = 0; round < limit; round++) {
      const x = keys.map((key) => given[key]);
      const open = out[place];
      if (!Number.isFinite(open)) return false;
      const far = Math.max(size, ...x.slice(angles).map(Math.abs));
      const step = x.map((value, i) => out[place + 1 + i] - value);
      if (!step.every(Number.isFinite)) return open <= 1e-12 * far;
      const big = Math.max(0, ...step.map((d, i) => Math.abs(d) / (i < angles ? 1 : far)));
      if (open <= 1.5e-14 * far && big <= 1e-7) return true;
      let factor = Math.min(1, 1 / (big || 1));
      for (let half = 0; half < 12; half++) {
        for (let i = 0; i < count; i++) given[keys[i]] = x[i] + factor * step[i];
        out = tape.one(given);
        if (out[place] <= open * (1 + 1e-12) || open <= 1.5e-14 * far) break;
        factor /= 2;
      }
      if (!(out[place] <= open * (1 + 1e-12)) && open <= 1e-12 * far) return true;
    }
    return out[place] <= 1e-12 * size;
  }

  // how each loop closes at the guess: signs and unknowns in `given`, which has the dimensions; says whether it can be so at all
  #choose(given, at) {
    at.forEach((q, j) => (given[`q${j}`] = q));
    for (const g of this.iterated) g.start.forEach((x, i) => (given[`x ${g.name} ${i}`] = x));
    for (const g of this.closed) given[`sign ${g.name}`] = g.sign;
    const choice = this.tapes.choice;
    let found = choice.one(given);
    for (const g of this.model.groups) {
      if (g.start) {
        // the program goes on to search from many starts; the page says that it cannot
        if (!this.#iterate(g, given)) return (given.open = g.name) && false;
        found = choice.one(given);
        continue;
      }
      const k = 5 * this.closed.indexOf(g);
      const margin = found[k];
      // two assemblies meet there: the one it was before
      given[`sign ${g.name}`] = Math.abs(margin) < 1e-14 || !Number.isFinite(found[k + 4]) ? g.sign : found[k + 4];
    }
    return !(found[found.length - 1] <= 0);
  }

  // the sign of a closed form at inputs, with the change points between the guess and them
  #signs(state, group, q) {
    const flips = state.flips.get(group.name);
    const base = state.given[`sign ${group.name}`];
    if (!flips?.length) return base;
    const count = (x) => flips.reduce((sum, f) => sum + (f <= x ? 1 : 0), 0);
    const before = count(state.at[0]);
    return Float64Array.from(q, (x) => ((count(x) - before) & 1 ? -base : base));
  }

  // an unknown of an iterated group between the samples of its way
  #between(state, key, q) {
    const { grid, unknowns } = state;
    const values = unknowns.get(key);
    const [first, step] = [grid[0], grid[1] - grid[0]];
    return Float64Array.from(q, (x) => {
      const place = Math.min(Math.max((x - first) / step, 0), grid.length - 1);
      const low = Math.min(Math.floor(place), grid.length - 2);
      const [a, b] = [values[low], values[low + 1]];
      if (!Number.isFinite(a)) return b;
      if (!Number.isFinite(b)) return a;
      return a + (b - a) * (place - low);
    });
  }

  // all that enters the tapes at inputs, one array for each input of the mechanism
  #entering(state, inputs) {
    const given = { ...state.given };
    inputs.forEach((q, j) => (given[`q${j}`] = q));
    const [q] = inputs;
    for (const g of this.closed) given[`sign ${g.name}`] = this.one ? this.#signs(state, g, q) : state.given[`sign ${g.name}`];
    if (this.iterated.length && this.one) {
      for (const g of this.iterated) {
        const keys = g.start.map((_, i) => `x ${g.name} ${i}`);
        for (const key of keys) given[key] = this.#between(state, key, q);
        for (let round = 0; round < 3; round++) {
          const out = this.tapes.steps.run(given, q.length);
          const bad = q.map((_, l) => (out[g.place][l] < 0.1 * this.model.size ? 0 : NaN));
          keys.forEach((key, i) => (given[key] = out[g.place + 1 + i].map((x, l) => x + bad[l])));
        }
        // a loop that stays open is not assembled
        const open = this.tapes.steps.run(given, q.length)[g.place];
        keys.forEach((key) => (given[key] = given[key].map((x, l) => (open[l] <= 1e-11 * this.model.size ? x : NaN))));
      }
    } else if (this.iterated.length) this.#alongLines(state, given, inputs);
    if (this.tapes.twists) this.#wind(state, given, inputs);
    return given;
  }

  // several inputs: every pose on its own straight line from the guess
  #alongLines(state, given, inputs) {
    const n = inputs[0].length;
    const keys = this.iterated.flatMap((g) => g.start.map((_, i) => `x ${g.name} ${i}`));
    const found = keys.map(() => new Float64Array(n).fill(NaN));
    for (let l = 0; l < n; l++) {
      const way = inputs.map((q, j) => q[l] - state.at[j]);
      const here = { ...state.given };
      let [gone, step] = [0, 1 / Math.max(1, Math.ceil(Math.max(...way.map(Math.abs)) / 0.1))];
      const least = step / 2 ** 20;
      while (gone < 1 && step > least) {
        const to = Math.min(1, gone + step);
        const trial = { ...here };
        way.forEach((d, j) => (trial[`q${j}`] = state.at[j] + to * d));
        const closes = this.iterated.every((g) => this.#iterate(g, trial, 8));
        if (closes && keys.every((key) => Math.abs(trial[key] - here[key]) < 0.3 * Math.max(1, Math.abs(here[key])))) {
          Object.assign(here, trial);
          gone = to;
          step *= 2;
        } else step /= 2;
      }
      if (gone >= 1) keys.forEach((key, k) => (found[k][l] = here[key]));
    }
    keys.forEach((key, k) => (given[key] = found[k]));
  }

  // the whole turns of torsion springs, followed from the guess
  #wind(state, given, inputs) {
    const [q] = inputs;
    const within = this.tapes.twists.run(given, q.length);
    for (const [s, turns] of this.model.springs.entries()) {
      const near = within[s].map((x, l) => {
        if (!this.one || !state.twists) return x;
        const values = state.twists[s];
        const place = Math.round((q[l] - state.grid[0]) / (state.grid[1] - state.grid[0]));
        const followed = values[Math.min(Math.max(place, 0), values.length - 1)];
        return x + TAU * Math.round((followed - x) / TAU);
      });
      given[`near spring ${s}`] = near.map((x) => x + TAU * turns);
    }
  }

  // along the one input from low to high: change points, limits, the unknowns of iterated groups
  #look(state, low, high) {
    const input = this.model.inputs[0];
    const turn = input.slides ? this.model.size : TAU;
    if (!(high - low > 1e-9 * turn)) [low, high] = [low - 1e-3 * turn, high + 1e-3 * turn];
    const steps = Math.min(40000, Math.max(8, Math.ceil((PER_TURN * (high - low)) / turn)));
    const grid = Float64Array.from({ length: steps + 7 }, (_, i) => low + ((high - low) * (i - 2.5)) / steps);
    Object.assign(state, { grid, flips: new Map(), limits: [], unknowns: new Map(), turn });
    const given = { ...state.given, q0: grid };
    for (const g of this.iterated) g.start.forEach((_, i) => (given[`x ${g.name} ${i}`] = NaN));
    let margins;
    for (const g of this.model.groups) {
      if (g.start) {
        this.#march(state, g, given);
        margins = undefined;
        continue;
      }
      margins ??= this.tapes.margins.run(given, grid.length);
      const k = this.closed.indexOf(g);
      const flips = this.#touches(state, g, k, grid, margins[k], [low, high]);
      if (flips.length) {
        state.flips.set(g.name, flips);
        given[`sign ${g.name}`] = this.#signs(state, g, grid);
        margins = undefined;
      }
    }
    if (this.tapes.twists) {
      const at = Math.round((state.at[0] - grid[0]) / (grid[1] - grid[0]));
      const whole = this.tapes.twists.run(given, grid.length);
      state.twists = whole.map((values) => {
        const found = Float64Array.from(values);
        for (let i = at + 1; i < found.length; i++) found[i] += TAU * Math.round((found[i - 1] - found[i]) / TAU) || 0;
        for (let i = at - 1; i >= 0; i--) found[i] += TAU * Math.round((found[i + 1] - found[i]) / TAU) || 0;
        return found;
      });
    }
  }

  // where the radicand of a group touches zero; where it crosses, a limit is noted
  #touches(state, g, k, grid, m, [low, high]) {
    if (!m.some((x) => x < DIP)) return [];
    const margin = (q) => this.tapes.margins.run(this.#beside(state, q), q.length)[k];
    const found = [];
    const note = (q) => {
      const same = 1e-6 * state.turn;
      // a guess at one of them means the branch beyond it
      const here = Math.abs(q - state.at[0]) < 1e-9 * state.turn ? Math.min(q, state.at[0]) : q;
      if (q > low - same && q < high + same && !found.some((f) => Math.abs(f - q) < same)) found.push(here);
    };
    const zero = (x) => Math.abs(x) <= TOUCHES;
    for (let i = 1; i + 1 < grid.length; i++) {
      if (m[i] < DIP && m[i] <= m[i - 1] && m[i] <= m[i + 1] && m[i - 1] > 0 && m[i + 1] > 0 && m[i] > -TOUCHES) {
        // followed down
        let [centre, half, least] = [grid[i], grid[i + 1] - grid[i], m[i]];
        for (let round = 0; round < 9 && half > 1e-9 * state.turn; round++) {
          const near = Float64Array.from({ length: 33 }, (_, l) => centre + (half * (l - 16)) / 16);
          const below = margin(near);
          let lowest = 16;
          for (let l = 0; l < 33; l++) if (below[l] < below[lowest]) lowest = l;
          [centre, least] = [near[lowest], below[lowest]];
          half /= 8;
          if (least < -TOUCHES) break;
        }
        if (zero(least)) note(centre);
        else if (least < 0) {
          state.limits.push([this.#crossing(margin, grid[i - 1], centre), -1, g.name]);
          state.limits.push([this.#crossing(margin, centre, grid[i + 1]), 1, g.name]);
        }
      }
    }
    for (let i = 0; i + 1 < grid.length; i++) {
      if (m[i] >= 0 === m[i + 1] >= 0 || zero(m[i]) || zero(m[i + 1]) || !Number.isFinite(m[i] + m[i + 1])) continue;
      const q = this.#crossing(margin, grid[i], grid[i + 1]);
      if (q >= low - 1e-9 * state.turn && q <= high + 1e-9 * state.turn) state.limits.push([q, m[i] >= 0 ? -1 : 1, g.name]);
    }
    return found.sort((a, b) => a - b);
  }

  // a root between two inputs: regula falsi (Illinois), then the last bits by halves
  #crossing(margin, a, b) {
    const at = (q) => margin(Float64Array.of(q, q))[0];
    let [fa, fb] = [at(a), at(b)];
    for (let round = 0; round < 200; round++) {
      if (fa === 0 || fb === 0 || Math.abs(b - a) <= 2 * Number.EPSILON * Math.max(Math.abs(a), Math.abs(b))) break;
      let q = b - (fb * (b - a)) / (fb - fa);
      if (!(Math.min(a, b) < q && q < Math.max(a, b))) {
        q = (a + b) / 2;
        if (q === a || q === b) break;
      }
      const f = at(q);
      if (f >= 0 !== fb >= 0) [a, fa] = [b, fb];
      else fa *= 0.5;
      [b, fb] = [q, f];
    }
    return Math.abs(fa) < Math.abs(fb) ? a : b;
  }

  // what enters at further inputs, as far as groups are looked through
  #beside(state, q) {
    const given = { ...state.given, q0: q };
    for (const g of this.closed) given[`sign ${g.name}`] = this.#signs(state, g, q);
    for (const g of this.iterated) {
      g.start.forEach((_, i) => {
        const key = `x ${g.name} ${i}`;
        given[key] = state.unknowns.has(key) ? this.#between(state, key, q) : NaN;
      });
    }
    return given;
  }

  // an iterated group from the guess both ways, each pose from the last ones
  #march(state, g, given) {
    const { grid } = state;
    const keys = g.start.map((_, i) => `x ${g.name} ${i}`);
    const found = keys.map(() => new Float64Array(grid.length).fill(NaN));
    const scalar = (q) => {
      const here = { ...state.given, q0: q };
      for (const other of this.closed) {
        const sign = this.#signs(state, other, [q]);
        here[`sign ${other.name}`] = typeof sign === "number" ? sign : sign[0];
      }
      for (const other of this.iterated) {
        if (other === g) break;
        other.start.forEach((_, i) => (here[`x ${other.name} ${i}`] = this.#between(state, `x ${other.name} ${i}`, [q])[0]));
      }
      return here;
    };
    const size = this.model.size;
    const far = (i) => (i < g.angles ? 1 : size);
    for (const way of [1, -1]) {
      let q = state.at[0];
      let x = keys.map((key) => state.given[key]);
      let slope = x.map(() => 0);
      let fresh = true;
      const from = way > 0 ? grid.findIndex((p) => p > q) : grid.findLastIndex((p) => p <= q);
      for (let i = from; i >= 0 && i < grid.length; i += way) {
        let step = grid[i] - q;
        const least = Math.abs(step) / 2 ** 26;
        let ended = false;
        while (q !== grid[i]) {
          if (Math.abs(grid[i] - q) <= Math.abs(step)) step = grid[i] - q;
          const to = step === grid[i] - q ? grid[i] : q + step;
          const trial = scalar(to);
          keys.forEach((key, k) => (trial[key] = x[k] + slope[k] * step));
          const closes = this.#iterate(g, trial, 10);
          const moved = keys.map((key, k) => (trial[key] - x[k]) / far(k));
          const change = Math.max(...moved.map(Math.abs));
          const off = Math.max(...keys.map((key, k) => Math.abs(trial[key] - x[k] - slope[k] * step) / far(k)));
          if (closes && change < 0.3 && (fresh || off <= 0.2 * Math.max(change, 1e-4))) {
            slope = keys.map((key, k) => (trial[key] - x[k]) / step);
            x = keys.map((key) => trial[key]);
            q = to;
            fresh = false;
          } else {
            step /= 2;
            if (Math.abs(step) < least) {
              ended = true;
              break;
            }
          }
        }
        if (ended) {
          state.limits.push([q, -way, g.name]);
          break;
        }
        keys.forEach((_, k) => (found[k][i] = x[k]));
      }
    }
    keys.forEach((key, k) => {
      state.unknowns.set(key, found[k]);
      given[key] = found[k];
    });
  }

  // all poses of the sweep and one more, the free one: numbers by their paths, the inputs of the free pose
  solve(numbers, free) {
    const [given, at] = [this.#given(numbers), this.#start(numbers)];
    const inputs = this.sweep.map((q, j) => Float64Array.of(...q, free[j]));
    const state = { given, at, inputs, flips: new Map(), limits: [], unknowns: new Map(), numbers };
    state.chosen = Object.values(numbers).every(Number.isFinite) && this.#choose(given, at);
    if (!state.chosen) return state;
    if (this.one) {
      const known = inputs[0].filter(Number.isFinite);
      this.#look(state, Math.min(at[0], known.reduce((a, b) => Math.min(a, b), Infinity)), Math.max(at[0], known.reduce((a, b) => Math.max(a, b), -Infinity)));
    }
    state.entering = this.#entering(state, inputs);
    const out = this.tapes.pose.run(state.entering, this.n + 1);
    if (this.one && state.flips.size) this.#through(state, out);
    state.closed = out.pop();
    state.rows = out;
    return state;
  }

  // poses beside a change point: a polynomial through poses on both sides
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
      const values = this.tapes.pose.run(this.#entering(state, [nodes]), count);
      if (!values.every((row) => row.every(Number.isFinite))) continue;
      for (const [r, row] of values.entries()) {
        if (this.angleRows.has(r)) for (let k = 1; k < count; k++) row[k] += TAU * Math.round((row[k - 1] - row[k]) / TAU);
        for (const l of near) {
          let [sum, total] = [0, 0];
          let exact = -1;
          for (let k = 0; k < count; k++) {
            const d = q[l] - nodes[k];
            if (d === 0) exact = k;
            sum += (weights[k] / d) * row[k];
            total += weights[k] / d;
          }
          let x = exact < 0 ? sum / total : row[exact];
          if (this.angleRows.has(r)) x -= TAU * Math.round(x / TAU);
          out[r][l] = x;
          state.interpolated.add(l);
        }
      }
    }
  }

  // the limits of the input over the turn from the guess: [input, side on which it is assembled, group]
  limits(numbers) {
    const [given, at] = [this.#given(numbers), this.#start(numbers)];
    const state = { given, at, flips: new Map(), limits: [], unknowns: new Map(), numbers };
    if (!this.one || !this.#choose(given, at)) return [];
    const length = this.model.inputs[0].slides ? this.model.size : TAU;
    this.#look(state, this.iterated.length ? at[0] - length : at[0], at[0] + length);
    return state.limits.sort((a, b) => a[0] - b[0]);
  }

  // the first loop of a pose that does not close, and by how much, m; null where that is not known
  short(state, l) {
    if (!state.chosen) return null;
    const out = this.tapes.short.one(this.#at(state, l));
    const names = this.model.groups.filter((g) => !g.start).map((g) => g.name);
    for (const [k, by] of out.entries()) if (by > 0) return [names[k] ?? "", by];
    return null;
  }

  // what enters at one pose
  #at(state, l) {
    return Object.fromEntries(Object.entries(state.entering).map(([name, x]) => [name, typeof x === "number" ? x : x[l]]));
  }

  // how far the rows of a pose are from the same operations in 32 digits
  errors(state, l) {
    if (state.interpolated?.has(l)) return null;
    const twice = this.tapes.pose.twice(this.#at(state, l));
    return twice.slice(0, -1).map(([high, low], r) => Math.abs(high - state.rows[r][l] + low));
  }

  // a quantity at a pose, SI and radians
  value(state, { row, less, turns, order, zero }, l) {
    if (!state.rows || !Number.isFinite(state.closed[l])) return NaN;
    if (zero) return 0;
    if (order && !this.moves(state)) return NaN;
    const x = state.rows[row][l] - (less === undefined ? 0 : state.rows[less][l]);
    return turns && x < 0 ? (x + TAU < TAU ? x + TAU : 0) : x + 0;
  }

  // whether anything has a speed
  moves(state) {
    return this.model.inputs.some((_, j) => ["v", "a", "j"].some((name) => state.given[`${name}${j}`]));
  }

  // the numbers of the drawing that follow from the dimensions
  drawn(state) {
    return this.tapes.drawn.one(state.given);
  }
}

// --- the numbers of the moment ------------------------------------------------------------------------------------------
let machine, numbers, freePose, state;
const wrong = new Set(); // what was typed and is no number
function begin(data) {
  machine = new Machine(data.model, tapes);
  [numbers, freePose] = [{ ...machine.own }, data.model.first.slice()];
  const [series] = data.series;
  recompute(series);
  // the original, as a ghost where numbers have changed
  const columns = series.columns.map((c) => ({ ...c, values: c.values.slice() }));
  const { shapes, bodies } = structuredClone({ shapes: series.shapes, bodies: series.bodies });
  data.series.push({ ...series, columns, shapes, bodies, name: TEXTS.original, hidden: () => !changes().length });
}
const changes = () => Object.keys(numbers).filter((path) => !Object.is(numbers[path], machine.own[path]));
function recompute(series) {
  state = wrong.size ? { chosen: false } : machine.solve(numbers, freePose);
  // what one of a unit is in SI, or how many of it make one: the one of them that is a whole number is exact
  const inUnit = (x, si) => (si < 1 && Math.abs(Math.round(1 / si) * si - 1) < 1e-15 ? x * Math.round(1 / si) : x / si);
  for (const column of series.columns) {
    const si = column.si ?? 1;
    if ("input" in column) {
      for (let l = 0; l <= machine.n; l++) column.values[l] = inUnit(l < machine.n ? machine.sweep[column.input][l] : freePose[column.input], si);
    } else for (let l = 0; l <= machine.n; l++) column.values[l] = inUnit(machine.value(state, column, l), si);
  }
  if (!state.rows) return;
  const drawn = machine.drawn(state);
  for (const [i, what, k, row] of machine.model.drawn) {
    if (what === "label") series.labels[i].z[k] = drawn[row];
    else if (what === "at") series.bodies[i].at[k] = drawn[row];
    else if (what === "s") series.shapes[i].s = drawn[row];
    else series.shapes[i][what][k] = drawn[row];
  }
}
