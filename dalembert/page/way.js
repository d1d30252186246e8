// A mechanism that is computed anew: its tapes with the numbers of the moment. No formula of mechanics stands here; what is done is
// the choice of each loop's assembly, the look along the input for places where a radicand touches or crosses zero, and iteration.
const TAU = 2 * Math.PI;
const TOUCHES = 1e-13; // a radicand so small is zero but for rounding
const DIP = 0.05; // a radicand below this may touch zero between two samples
const PER_TURN = 720; // samples of a turn
const FAR = 1; // rad: what turns farther than this between two samples is looked at in between
const SHUT = 64 * Number.EPSILON; // a loop no farther open than this share of the size is closed

// what enters a tape at one of its lanes
const lane = (entering, l) => Object.fromEntries(Object.entries(entering).map(([name, x]) => [name, typeof x === "number" ? x : x[l]]));

// an angle in (−π, π]; what stands at half a turn but for its rounding is at +π
const principal = (angle) => angle - TAU * Math.ceil((angle - Math.PI - 1e-9) / TAU);

// values at nodes, linear between them; before the first and after the last as there
function interpolated(nodes, values, at) {
  let [low, high] = [0, nodes.length - 1];
  if (at <= nodes[low]) return values[low];
  if (at >= nodes[high]) return values[high];
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (nodes[middle] <= at) low = middle;
    else high = middle;
  }
  return ((values[high] - values[low]) / (nodes[high] - nodes[low])) * (at - nodes[low]) + values[low];
}

class Way {
  constructor(model, tapes) {
    this.model = model;
    const { lists, ...every } = tapes;
    const whole = listed(lists);
    this.tapes = Object.fromEntries(Object.entries(every).map(([name, tape]) => [name, new Tape(tape, whole)]));
    this.kinds = new Map(model.dimensions.map(([path, kind]) => [path, kind]));
    this.own = Object.fromEntries(model.dimensions.map(([path, , value]) => [path, value]));
    this.n = model.n;
    this.sweep = model.inputs.map((input) => unpack(input.sweep, model.n));
    this.one = model.inputs.length === 1;
    // what changes along the sweep has its values at the poses; the free one has the file's own rates, and no time
    const along = (packed, free = NaN) => Float64Array.of(...unpack(packed, model.n), free);
    this.rates = model.inputs.map(({ rates, rated, paths }) => {
      if (rates.every((rate) => "all" in rate)) return rates.map((rate) => rate.all);
      return rates.map((rate, k) => along(rate, rated ? (this.own[paths[k + 1]] ?? 0) : NaN));
    });
    if (model.time) this.time = along(model.time);
    this.closed = model.groups.filter((g) => !g.start);
    this.iterated = model.groups.filter((g) => g.start);
    if (this.tapes.rubs) this.rubbing = new Fitted(this.tapes.rubs, this.tapes.slopes, this.tapes.rubs.outputs.map((_, k) => `friction ${k}`));
    this.winding = this.closed.flatMap((g) => g.winds);
    let [place, guess] = [0, 0];
    for (const g of this.iterated) {
      Object.assign(g, { place, guess, keys: g.start.map((_, i) => `x ${g.name} ${i}`) });
      place += 1 + g.start.length;
      guess += g.start.length + g.rows * (1 + g.free.length) + 1;
    }
    this.angleRows = new Set();
    for (const q of Object.values(model.quantities)) if (q.turns) this.angleRows.add(q.row);
  }

  // Newton's method on the steps of a tape: the unknowns of a group in `entering`; says whether its loops close
  iterate(group, entering, limit = 60) {
    const { name, start, angles, place } = group;
    const count = start.length;
    const keys = start.map((_, i) => `x ${name} ${i}`);
    const tape = this.tapes.steps;
    let out = tape.one(entering);
    const size = this.model.size;
    for (let round = 0; round < limit; round++) {
      const x = keys.map((key) => entering[key]);
      const open = out[place];
      if (!Number.isFinite(open)) return false;
      const far = Math.max(size, ...x.slice(angles).map(Math.abs));
      const step = x.map((value, i) => out[place + 1 + i] - value);
      if (!step.every(Number.isFinite)) return open <= 1e-12 * far;
      const big = Math.max(0, ...step.map((d, i) => Math.abs(d) / (i < angles ? 1 : far)));
      if (open <= SHUT * far && big <= 1e-7) return true;
      let factor = Math.min(1, 1 / (big || 1));
      for (let half = 0; half < 12; half++) {
        for (let i = 0; i < count; i++) entering[keys[i]] = x[i] + factor * step[i];
        out = tape.one(entering);
        if (out[place] <= open * (1 + 1e-12) || open <= SHUT * far) break;
        factor /= 2;
      }
      // no part of the step brings it nearer
      if (!(out[place] <= open * (1 + 1e-12)) && !(open <= SHUT * far)) return open <= 1e-12 * far;
    }
    return out[place] <= 1e-12 * size;
  }

  // the sign of a closed form at inputs, with the change points between the guess and them
  signs(state, group, q) {
    const flips = state.flips.get(group.name);
    const base = state.fixed[`sign ${group.name}`];
    if (!flips?.length) return base;
    const count = (x) => flips.reduce((sum, f) => sum + (f <= x ? 1 : 0), 0);
    const before = count(state.at[0]);
    return Float64Array.from(q, (x) => ((count(x) - before) & 1 ? -base : base));
  }

  // an unknown of an iterated group between the samples of its way
  between(state, key, q) {
    const { nodes, values, ends } = state.unknowns.get(key);
    // beyond its limits a branch stands as a turn before, where there is one way to
    const span = ends[1] - ends[0];
    const turned = this.model.comesBack && span <= TAU && ![...state.flips.values()].some((flips) => flips.length);
    const within = (at) => ends[0] + ((((at - ends[0]) % TAU) + TAU) % TAU);
    const end = nodes.length - 1;
    const close = 1e-9 * state.turn; // the last node stands so far from a limit at most
    return Float64Array.from(q, (at) => {
      if (turned && (at < ends[0] || at > ends[1]) && within(at) <= ends[1]) at = within(at);
      if (!(at > nodes[0] - close && at < nodes[end] + close)) return NaN;
      return interpolated(nodes, values, at);
    });
  }

  // the whole turns of the angle in a row of the tape of them, counted from the guess along the input
  follow(state, row, grid) {
    const [start] = state.at;
    const angle = (q) => this.tapes.winds.run(this.entering(state, q), q.length)[row];
    let nodes = Float64Array.from(new Set([...grid, start])).sort();
    let angles = Float64Array.from(angle(nodes));
    for (let round = 0; round < 64; round++) {
      const more = [];
      for (let i = 0; i + 1 < nodes.length; i++) {
        const there = [angles[i], angles[i + 1]].map(Number.isFinite);
        const far = there[0] !== there[1] || Math.abs(2 * Math.sin((angles[i + 1] - angles[i]) / 2)) > FAR;
        if (far && nodes[i + 1] - nodes[i] > 1e-9 * state.turn) more.push((nodes[i] + nodes[i + 1]) / 2);
      }
      if (!more.length) break;
      const between = Float64Array.from(more);
      const every = new Map([...nodes].map((q, i) => [q, angles[i]]));
      for (const [i, x] of angle(between).entries()) every.set(more[i], x);
      nodes = Float64Array.from(every.keys()).sort();
      angles = nodes.map((q) => every.get(q));
    }
    const good = nodes.filter((_, i) => Number.isFinite(angles[i]));
    const values = angles.filter(Number.isFinite);
    for (let i = 1; i < values.length; i++) values[i] -= TAU * Math.round((values[i] - values[i - 1]) / TAU);
    const here = interpolated(good, values, start);
    return { nodes: good, values: values.map((x) => x + (principal(here) - here)) };
  }

  // angles with their whole turns at inputs, of the bodies that are followed so far
  turned(state, entering, q) {
    for (const body of this.winding) entering[`near ${body}`] = NaN;
    for (const [body, { nodes, values }] of state.turns) entering[`near ${body}`] = Float64Array.from(q, (at) => interpolated(nodes, values, at));
  }

  // along the one input from low to high: change points, limits, the unknowns of iterated groups
  look(state, low, high, again = false) {
    const input = this.model.inputs[0];
    const turn = input.slides ? this.model.size : TAU;
    if (!(high - low > 1e-9 * turn)) [low, high] = [low - 1e-3 * turn, high + 1e-3 * turn];
    const steps = Math.min(40000, Math.max(8, Math.ceil((PER_TURN * this.model.pace * (high - low)) / turn)));
    const grid = Float64Array.from({ length: steps + 7 }, (_, i) => low + ((high - low) * (i - 2.5)) / steps);
    Object.assign(state, { grid, flips: new Map(), limits: [], unknowns: new Map(), ends: new Map(), turns: new Map(), turn });
    const entering = { ...state.fixed, q0: grid };
    for (const g of this.iterated) g.start.forEach((_, i) => (entering[`x ${g.name} ${i}`] = NaN));
    for (const body of this.winding) entering[`near ${body}`] = NaN;
    let margins;
    for (const g of this.model.groups) {
      if (g.start) {
        this.march(state, g, entering);
        margins = undefined;
        continue;
      }
      margins ??= this.tapes.margins.run(entering, grid.length);
      const k = this.closed.indexOf(g);
      const flips = this.touches(state, g, k, grid, margins[k], [low, high]);
      if (flips.length) {
        state.flips.set(g.name, flips);
        entering[`sign ${g.name}`] = this.signs(state, g, grid);
        margins = undefined;
      }
      for (const body of g.winds) {
        state.turns.set(body, this.follow(state, this.winding.indexOf(body), grid));
        this.turned(state, entering, grid);
        margins = undefined;
      }
    }
    if (this.model.comesBack && !again) {
      // beyond one limit the branch may stand as a turn before: then the other one matters too
      let [from, to] = [low, high];
      for (const [first, last] of state.ends.values()) {
        if (last < high) from = Math.min(from, last - TAU);
        if (first > low) to = Math.max(to, first + TAU);
      }
      if (from < low || to > high) return this.look(state, from, to, true);
    }
    if (this.tapes.twists) {
      const at = Math.round((state.at[0] - grid[0]) / (grid[1] - grid[0]));
      const whole = this.tapes.twists.run(entering, grid.length);
      state.twists = whole.map((values) => {
        const unwrapped = Float64Array.from(values);
        for (let i = at + 1; i < unwrapped.length; i++) unwrapped[i] += TAU * Math.round((unwrapped[i - 1] - unwrapped[i]) / TAU) || 0;
        for (let i = at - 1; i >= 0; i--) unwrapped[i] += TAU * Math.round((unwrapped[i + 1] - unwrapped[i]) / TAU) || 0;
        return unwrapped;
      });
    }
  }

  // where the radicand of a group touches zero; where it crosses, a limit is noted
  touches(state, g, k, grid, m, [low, high]) {
    if (!m.some((x) => x < DIP)) return [];
    const margin = (q) => this.tapes.margins.run(this.entering(state, q), q.length)[k];
    const flips = [];
    const note = (q) => {
      const same = 1e-6 * state.turn;
      // a guess at one of them means the branch beyond it
      const here = Math.abs(q - state.at[0]) < 1e-9 * state.turn ? Math.min(q, state.at[0]) : q;
      if (q > low - same && q < high + same && !flips.some((f) => Math.abs(f - q) < same)) flips.push(here);
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
          state.limits.push([this.crossing(margin, grid[i - 1], centre), -1, g.name]);
          state.limits.push([this.crossing(margin, centre, grid[i + 1]), 1, g.name]);
        }
      }
    }
    for (let i = 0; i + 1 < grid.length; i++) {
      if (m[i] >= 0 === m[i + 1] >= 0 || zero(m[i]) || zero(m[i + 1]) || !Number.isFinite(m[i] + m[i + 1])) continue;
      const q = this.crossing(margin, grid[i], grid[i + 1]);
      if (q >= low - 1e-9 * state.turn && q <= high + 1e-9 * state.turn) state.limits.push([q, m[i] >= 0 ? -1 : 1, g.name]);
    }
    return flips.sort((a, b) => a - b);
  }

  // a root between two inputs: regula falsi (Illinois), then the last bits by halves
  crossing(margin, a, b) {
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
  entering(state, q) {
    const entering = { ...state.fixed, q0: q };
    for (const g of this.closed) entering[`sign ${g.name}`] = this.signs(state, g, q);
    this.turned(state, entering, q);
    for (const g of this.iterated) {
      g.start.forEach((_, i) => {
        const key = `x ${g.name} ${i}`;
        entering[key] = state.unknowns.has(key) ? this.between(state, key, q) : NaN;
      });
    }
    return entering;
  }

  // an iterated group from the guess both ways, each pose from the last ones
  march(state, g, entering) {
    const { grid } = state;
    const keys = g.start.map((_, i) => `x ${g.name} ${i}`);
    state.ends.set(g.name, [-Infinity, Infinity]);
    const nodes = [[state.at[0], keys.map((key) => state.fixed[key])]];
    const scalar = (q) => {
      // what does not change is not copied
      const here = Object.assign(Object.create(state.fixed), { q0: q });
      for (const [body, { nodes, values }] of state.turns) here[`near ${body}`] = interpolated(nodes, values, q);
      for (const other of this.closed) {
        const sign = this.signs(state, other, [q]);
        here[`sign ${other.name}`] = typeof sign === "number" ? sign : sign[0];
      }
      for (const other of this.iterated) {
        if (other === g) break;
        other.start.forEach((_, i) => (here[`x ${other.name} ${i}`] = this.between(state, `x ${other.name} ${i}`, [q])[0]));
      }
      return here;
    };
    const size = this.model.size;
    const least = (grid[1] - grid[0]) / 2 ** 26;
    // what comes after it is looked through at every sample
    const stride = g === this.model.groups.at(-1) ? 6 : 1;
    for (const way of [1, -1]) {
      let q = state.at[0];
      let x = keys.map((key) => state.fixed[key]);
      let slope = x.map(() => 0);
      const far = (i) => (i < g.angles ? 1 : Math.max(size, Math.abs(x[i]))); // a slide that runs away is measured by itself
      let fresh = true;
      const from = way > 0 ? grid.findIndex((p) => p > q) : grid.findLastIndex((p) => p <= q);
      const last = way > 0 ? grid.length - 1 : 0;
      let ended = false;
      for (let i = from < 0 ? last : from - way; i !== last && !ended; ) {
        i += fresh ? way : way * Math.min(stride, Math.abs(last - i));
        let step = grid[i] - q;
        while (q !== grid[i]) {
          if (Math.abs(grid[i] - q) <= Math.abs(step)) step = grid[i] - q;
          const to = step === grid[i] - q ? grid[i] : q + step;
          const trial = scalar(to);
          keys.forEach((key, k) => (trial[key] = x[k] + slope[k] * step));
          const closes = this.iterate(g, trial, 10);
          const moved = keys.map((key, k) => (trial[key] - x[k]) / far(k));
          const change = Math.max(...moved.map(Math.abs));
          const off = Math.max(...keys.map((key, k) => Math.abs(trial[key] - x[k] - slope[k] * step) / far(k)));
          if (closes && change < 0.3 && (fresh || off <= 0.2 * Math.max(change, 1e-4))) {
            slope = keys.map((key, k) => (trial[key] - x[k]) / step);
            x = keys.map((key) => trial[key]);
            q = to;
            fresh = false;
            nodes.push([q, x]);
            step *= 2;
          } else {
            step /= 2;
            if (Math.abs(step) < least) {
              ended = true;
              break;
            }
          }
        }
      }
      if (ended) {
        state.limits.push([q, -way, g.name]);
        state.ends.get(g.name)[way > 0 ? 1 : 0] = q;
      }
    }
    nodes.sort((a, b) => a[0] - b[0]);
    const at = Float64Array.from(nodes, ([q]) => q);
    keys.forEach((key, k) => {
      state.unknowns.set(key, { nodes: at, values: Float64Array.from(nodes, ([, x]) => x[k]), ends: state.ends.get(g.name) });
      entering[key] = this.between(state, key, grid);
    });
  }
}
