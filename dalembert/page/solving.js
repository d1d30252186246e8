// Systems of equations as tapes give them: least squares, dependent equations, what fits its own effect; starts of a search, tables.
// No formula of mechanics stands here.

// the x of least |Σ x_j·column_j + gap|, by Householder's reflections; columns are arrays
function leastSquares(columns, gap) {
  const [a, b] = [columns.map((column) => [...column]), gap.map((x) => -x)];
  const count = a.length;
  for (let j = 0; j < count; j++) {
    const v = a[j].map((x, i) => (i < j ? 0 : x));
    v[j] += Math.sign(v[j] || 1) * Math.hypot(...v);
    const square = v.reduce((sum, x) => sum + x * x, 0);
    for (const w of [...a.slice(j), b]) {
      const share = (2 * v.reduce((sum, x, i) => sum + x * w[i], 0)) / square;
      v.forEach((x, i) => (w[i] -= share * x));
    }
  }
  const x = new Array(count);
  for (let j = count - 1; j >= 0; j--) x[j] = (b[j] - a.slice(j + 1).reduce((sum, column, k) => sum + column[j] * x[j + 1 + k], 0)) / a[j][j];
  return x;
}

// A·f + b = 0 of dependent equations, by reflections with the longest column next: what is determined of f, NaN for the rest;
// all NaN where b asks for what no f gives. Shares below `null` of the largest are none.
function determined(a, b, count, none = 1e-9) {
  const columns = Array.from({ length: count }, (_, j) => a.map((row) => row[j]));
  const right = b.map((x) => -x);
  const order = columns.map((_, j) => j);
  const largest = Math.max(...right.map(Math.abs));
  let rank = 0;
  for (let first = 0; rank < Math.min(count, right.length); rank++) {
    const size = (j) => Math.hypot(...columns[j].slice(rank));
    let [next, most] = [rank, -1];
    for (let j = rank; j < count; j++) if (size(j) > most) [next, most] = [j, size(j)];
    first = rank ? first : most;
    if (!(most > none * first)) break;
    for (const list of [columns, order]) [list[rank], list[next]] = [list[next], list[rank]];
    const v = columns[rank].map((x, i) => (i < rank ? 0 : x));
    v[rank] += (v[rank] < 0 ? -1 : 1) * most;
    const square = v.reduce((sum, x) => sum + x * x, 0);
    for (const w of [...columns.slice(rank), right]) {
      let share = 0;
      for (let i = rank; i < v.length; i++) share += v[i] * w[i];
      share *= 2 / square;
      for (let i = rank; i < v.length; i++) w[i] -= share * v[i];
    }
  }
  const back = (y) => {
    const x = new Array(rank);
    for (let i = rank - 1; i >= 0; i--) {
      let rest = y[i];
      for (let k = i + 1; k < rank; k++) rest -= columns[k][i] * x[k];
      x[i] = rest / columns[i][i];
    }
    return x;
  };
  const f = new Array(count).fill(NaN);
  if (!right.every(Number.isFinite) || right.slice(rank).some((x) => Math.abs(x) > 1e-9 * largest)) return f;
  back(right).forEach((x, i) => (f[order[i]] = x));
  // a state of self-stress for each column that depends on those before it
  for (let j = rank; j < count; j++) {
    const stress = back(columns[j]);
    const length = Math.hypot(1, ...stress);
    stress.forEach((x, i) => Math.abs(x) > 1e-7 * length && (f[order[i]] = NaN));
    f[order[j]] = NaN;
  }
  return f;
}

const CLOSE = 8e-14; // relative: what changes by less has settled

// the numbers of some lanes alone
const chosen = (entering, lanes) => Object.fromEntries(Object.entries(entering).map(([name, x]) => [name, typeof x === "number" ? x : Float64Array.from(lanes, (l) => x[l])]));

// the x of A·x = b, by elimination with the largest pivot, and the determinant
function eliminated(a, b) {
  const rows = a.map((row, i) => [...row, b[i]]);
  const count = rows.length;
  let determinant = 1;
  for (let j = 0; j < count; j++) {
    let most = j;
    for (let i = j + 1; i < count; i++) if (Math.abs(rows[i][j]) > Math.abs(rows[most][j])) most = i;
    if (most !== j) {
      [rows[j], rows[most]] = [rows[most], rows[j]];
      determinant = -determinant;
    }
    determinant *= rows[j][j];
    for (let i = j + 1; i < count; i++) {
      const share = rows[i][j] / rows[j][j];
      for (let k = j; k <= count; k++) rows[i][k] -= share * rows[j][k];
    }
  }
  const x = new Array(count);
  for (let j = count - 1; j >= 0; j--) {
    let rest = rows[j][count];
    for (let k = j + 1; k < count; k++) rest -= rows[j][k] * x[k];
    x[j] = rest / rows[j][j];
  }
  return [x, determinant];
}

// numbers that fit their own effect, f = effect(f), on tapes that give the effect and its slopes by f
class Fitted {
  constructor(effect, slopes, keys) {
    Object.assign(this, { effect, slopes, keys });
  }

  // f in `entering` for n lanes, from zero on: put in again and again until nothing changes, else followed from a small effect on; NaN in
  // lanes, which come back, where nothing fits
  fit(entering, n) {
    for (const key of this.keys) entering[key] = new Float64Array(n);
    let left = Array.from({ length: n }, (_, l) => l);
    const settled = new Uint8Array(n);
    for (let round = 0; round < 200 && left.length; round++) {
      const out = this.effect.run(left.length < n ? chosen(entering, left) : entering, left.length);
      left = left.filter((l, i) => {
        let change = 0;
        for (const [k, key] of this.keys.entries()) {
          const x = out[k][i];
          change = Math.max(change, Math.abs(x - entering[key][l]) / (x === 0 ? 1 : Math.abs(x)));
          entering[key][l] = x;
        }
        // what is not there at all is not looked for; what has settled is put in a few times more, for its last digits
        if (round === 0 && !out.every((row) => Number.isFinite(row[i]))) return false;
        if (change <= CLOSE) settled[l]++;
        return settled[l] < 5 && change !== 0;
      });
    }
    return left.filter((l) => {
      if (settled[l]) return false;
      const here = lane(entering, l);
      const f = this.#followed(here);
      for (const [k, key] of this.keys.entries()) entering[key][l] = f ? f[k] : NaN;
      return !f;
    });
  }

  // f of one lane from none on, as the effect grows; null where two solutions meet on the way and end
  #followed(here) {
    let [f, share, step] = [this.keys.map(() => 0), 0, 0.25];
    while (share < 1) {
      const ahead = Math.min(1, share + step);
      const next = this.#newton(f, ahead, here);
      if (next) [f, share, step] = [next, ahead, 2 * step];
      else if ((step /= 2) < 1e-4) return null;
    }
    return f;
  }

  // Newton's method for f = share·effect(f); null where it does not stay on the way
  #newton(f, share, here) {
    let last = Infinity;
    for (let round = 0; round < 12; round++) {
      this.keys.forEach((key, k) => (here[key] = f[k]));
      const effect = this.effect.one(here);
      const [step, determinant] = eliminated(this.#jacobian(here, share), f.map((x, k) => x - share * effect[k]));
      if (!(determinant > 0)) return null;
      f = f.map((x, k) => x - step[k]);
      const change = Math.max(...step.map((d, k) => Math.abs(d) / (Math.abs(share * effect[k]) + Math.abs(f[k]) + Number.MIN_VALUE)));
      if (change <= 8 * Number.EPSILON || (change < 1e-9 && change >= 0.5 * last)) return f;
      last = change;
    }
    return null;
  }

  #jacobian(here, share) {
    const slopes = this.slopes.one(here);
    return this.keys.map((_, i) => this.keys.map((_, j) => (i === j ? 1 : 0) - share * slopes[i * this.keys.length + j]));
  }

  // f of one lane in 32 digits, of which `exact` has some numbers: by how much it does not fit there, taken away once
  refined(here, exact) {
    const effect = this.effect.twice({ ...here, ...exact });
    const rest = this.keys.map((key, k) => here[key] - effect[k][0] - effect[k][1]);
    const [step] = eliminated(this.#jacobian(here, 1), rest);
    return Object.fromEntries(this.keys.map((key, k) => [key, two.add([here[key], 0], [-step[k] || 0, 0])]));
  }
}

// starts of an iterated group spread evenly over angles and slides: a Kronecker sequence of the generalised golden ratio
function* spread(g, size) {
  const count = g.start.length;
  let golden = 1;
  for (let round = 0; round < 64; round++) golden = (1 + golden) ** (1 / (count + 1));
  for (let k = 1; k <= Math.min(4096, 128 * count); k++) {
    yield g.start.map((_, i) => {
      const u = (0.5 + k * golden ** -(i + 1)) % 1;
      return i < g.angles ? u * TAU : (2 * u - 1) * size;
    });
  }
}

// the values of a table at places, linear between its rows; NaN outside
function tabled({ at, periodic, turns }, values, places) {
  const [first, end] = [at[0], at.at(-1)];
  const within = (angle, period) => first + ((angle - first) % period < 0 ? ((angle - first) % period) + period : (angle - first) % period);
  return places.map((place) => {
    if (turns) place = within(place, TAU);
    if (periodic) place = within(place, end - first);
    return place >= first && place <= end ? interpolated(at, values, place) : NaN;
  });
}
