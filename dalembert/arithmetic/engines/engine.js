// A tape in a browser: the real operations of a formula on lanes of numbers, in the order and with the roundings of every other
// engine; the same operations on numbers of 32 digits; sine, cosine and arctangent from the polynomials of compiled code.
// `F` holds their coefficients (javascript.py).

// --- bits -------------------------------------------------------------------------------------------------------------
const float = new Float64Array(1);
const halves = new Uint32Array(float.buffer); // the lower half first, as on every machine that shows pages
// the largest power of two that is no larger than the size of a number
function binade(x) {
  float[0] = x;
  halves[0] = 0;
  halves[1] &= 0x7ff00000;
  return float[0];
}
// a·b + c with one rounding, as processors have it (S. Boldo, G. Melquiond, IEEE Trans. Comput. 57 (2008) 462): the sum of the
// small parts is rounded to an odd last bit, so that it never decides a tie
function fma(a, b, c) {
  const p = a * b;
  let t = 134217729 * a;
  const ah = t - (t - a), al = a - ah;
  t = 134217729 * b;
  const bh = t - (t - b), bl = b - bh;
  const q = ((ah * bh - p) + ah * bl + al * bh) + al * bl;
  const th = c + q;
  let z = th - c;
  const tl = (c - (th - z)) + (q - z);
  const vh = p + th;
  z = vh - p;
  const vl = (p - (vh - z)) + (th - z);
  let w = tl + vl;
  z = w - tl;
  const e = (tl - (w - z)) + (vl - z);
  if (e !== 0) {
    float[0] = w;
    if (!(halves[0] & 1)) {
      if (e > 0 === w > 0) halves[0] |= 1;
      else if (halves[0]) halves[0]--;
      else {
        halves[0] = 0xffffffff;
        halves[1]--;
      }
      w = float[0];
    }
  }
  return vh + w;
}
function horner(z, c) {
  let value = c[c.length - 1];
  for (let k = c.length - 2; k >= 0; k--) value = fma(value, z, c[k]);
  return value;
}

// --- functions --------------------------------------------------------------------------------------------------------
const pair = [0, 0];
// [sin x, cos x], in one array for all calls
function sincos(x) {
  const shifted = x * F.twoOverPi + F.whole;
  const k = shifted - F.whole;
  const a = x - k * F.halfPi[0];
  let w = k * F.halfPi[1];
  const r = a - w;
  w = k * F.halfPi[2] - ((a - r) - w);
  const y = r - w;
  if (!(Math.abs(x) <= F.farthest && Math.abs(y) >= Math.abs(k) * F.nearest)) {
    pair[0] = Math.sin(x);
    pair[1] = Math.cos(x);
    return pair;
  }
  const rest = (r - y) - w;
  const z = y * y;
  let sine = y + fma(y * z, horner(z, F.sine), rest);
  const high = z * horner(z, F.cosine);
  const half = 0.5 * z;
  w = 1 - half;
  const cosine = w + (((1 - w) - half) + (z * high - y * rest));
  if (x === 0) sine = x;
  const odd = k & 1;
  pair[0] = k & 2 ? -(odd ? cosine : sine) : odd ? cosine : sine;
  pair[1] = (k + 1) & 2 ? -(odd ? sine : cosine) : odd ? sine : cosine;
  return pair;
}
function atan2(y, x) {
  let up = Math.abs(y), along = Math.abs(x);
  const steep = up > along;
  let most = steep ? up : along, least = steep ? along : up;
  if (!(most > F.smallest && most < F.largest && least < F.largest)) return Math.atan2(y, x);
  // products of the parts of a number stay within the range
  const scale = most > 1e200 ? 2 ** -600 : most < 1e-200 ? 2 ** 600 : 1;
  most *= scale;
  least *= scale;
  const far = least > F.steep * most;
  const above = far ? least - most : least, below = far ? least + most : most;
  const inverse = 1 / below;
  const t = above * inverse;
  const rounded = far ? least - (below - most) : 0;
  const left = fma(-t, below, above);
  const tRest = fma(-t, rounded, left) * inverse;
  const z = t * t, w = z * z;
  const small = t * (z * horner(w, F.arctangentOdd) + w * horner(w, F.arctangentEven));
  const back = x < 0;
  const base = steep ? 1.5707963267948966 : back ? Math.PI : 0;
  const baseRest = steep ? 6.12323399573676603587e-17 : back ? 1.22464679914735317722e-16 : 0;
  const sense = (back ? -1 : 1) * (steep ? -1 : 1);
  const rest = (baseRest + sense * (far ? F.quarter[1] : 0)) + sense * (t - (small - tRest));
  const angle = Math.abs((base + sense * (far ? F.quarter[0] : 0)) + rest);
  return y < 0 || Object.is(y, -0) ? -angle : angle;
}

// --- 32 digits: each number is the sum of two, the second below the rounding of the first (T. J. Dekker) -----------------
const two = {
  of: (x) => [x, 0],
  settled(high, low) {
    const total = high + low;
    return [total, low - (total - high)];
  },
  add(a, b) {
    const s = a[0] + b[0], z = s - a[0];
    return two.settled(s, (a[0] - (s - z)) + (b[0] - z) + (a[1] + b[1]));
  },
  neg: (a) => [-a[0], -a[1]],
  sub: (a, b) => two.add(a, [-b[0], -b[1]]),
  mul(a, b) {
    const p = a[0] * b[0];
    let t = 134217729 * a[0];
    const ah = t - (t - a[0]), al = a[0] - ah;
    t = 134217729 * b[0];
    const bh = t - (t - b[0]), bl = b[0] - bh;
    return two.settled(p, ((ah * bh - p) + ah * bl + al * bh) + al * bl + (a[0] * b[1] + a[1] * b[0]));
  },
  div(a, b) {
    const first = a[0] / b[0];
    const left = two.sub(a, two.mul(b, [first, 0]));
    return two.settled(first, (left[0] + left[1]) / b[0]);
  },
  abs: (a) => (a[0] < 0 ? two.neg(a) : a),
  binade: (a) => [binade(a[0]), 0],
  sqrt(a) {
    const first = Math.sqrt(a[0]);
    if (first === 0) return [first, 0];
    const left = two.sub(a, two.mul([first, 0], [first, 0]));
    return two.settled(first, (left[0] + left[1]) / (2 * first));
  },
  // by their series after a reduction with π/2 in four parts
  sincos(a) {
    const k = Math.round(a[0] * (2 / Math.PI));
    let r = a;
    for (const part of F.halfPiParts) r = two.sub(r, two.mul([part, 0], [k, 0]));
    const square = two.mul(r, r);
    let sine = [0, 0], cosine = [0, 0];
    for (let n = factorials.length / 2 - 1; n >= 0; n--) {
      const [odd, even] = [factorials[2 * n + 1], factorials[2 * n]];
      sine = two.add(two.mul(sine, square), n % 2 ? two.neg(odd) : odd);
      cosine = two.add(two.mul(cosine, square), n % 2 ? two.neg(even) : even);
    }
    sine = two.mul(sine, r);
    const quarter = ((k % 4) + 4) % 4;
    const [s, c] = quarter % 2 ? [cosine, sine] : [sine, cosine];
    return [quarter >= 2 ? two.neg(s) : s, quarter === 1 || quarter === 2 ? two.neg(c) : c];
  },
  sin: (a) => two.sincos(a)[0],
  cos: (a) => two.sincos(a)[1],
  // the float's arctangent with one correction
  atan2(y, x) {
    const first = [Math.atan2(y[0], x[0]), 0];
    const [sine, cosine] = two.sincos(first);
    const along = two.add(two.mul(x, cosine), two.mul(y, sine));
    if (along[0] === 0) return first;
    const rest = two.div(two.sub(two.mul(y, cosine), two.mul(x, sine)), along);
    return two.settled(first[0], rest[0] + rest[1]);
  },
  select: (test, positive, otherwise) => (test[0] > 0 ? positive : otherwise),
};
const factorials = [[1, 0]];
for (let n = 1; n < 32; n++) factorials.push(two.div(factorials[n - 1], [n, 0]));

// --- tapes --------------------------------------------------------------------------------------------------------------
const KINDS = ["add", "sub", "mul", "div", "neg", "abs", "binade", "sqrt", "sin", "cos", "atan2", "select"];
const ARITY = [2, 2, 2, 2, 1, 1, 1, 1, 1, 1, 2, 3, 3];
const PICK = 12; // of one number, and two lists by their numbers: the value in whose interval between knots it lies
// `above(knot)` says whether it lies beyond; as in choices of choices what is no number lies before all
function picked(above, knots, values) {
  let [low, high] = [0, knots.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if (above(knots[middle])) low = middle + 1;
    else high = middle;
  }
  return values[low];
}

// lists of constants as javascript.py writes them: one may be a part of a longer one
function listed(lists) {
  const whole = (list) => (list.of === undefined ? list : whole(lists[list.of]).slice(list.from, list.to));
  return lists.map(whole);
}

// A tape as javascript.py writes it: names of what enters, constants, operations one after the other, the places of the outputs.
class Tape {
  constructor({ enters, constants, operations, outputs }, lists = []) {
    Object.assign(this, { enters, constants, operations, outputs, lists });
    const before = enters.length + constants.length;
    this.steps = [];
    for (let i = 0; i < operations.length; ) {
      const kind = operations[i];
      this.steps.push([kind, before + this.steps.length, ...operations.slice(i + 1, i + 1 + ARITY[kind])]);
      i += 1 + ARITY[kind];
    }
    this.size = before + this.steps.length;
    // where each number is read last: its room is free from there on
    this.last = new Int32Array(this.size).fill(-1);
    for (const [s, [kind, , ...from]] of this.steps.entries()) for (const a of kind === PICK ? from.slice(0, 1) : from) this.last[a] = s;
    for (const k of outputs) this.last[k] = this.steps.length;
    // sine and cosine of one angle are worked out together
    const first = new Map();
    this.twin = new Map();
    for (const [kind, to, from] of this.steps) {
      if (kind !== 8 && kind !== 9) continue;
      if (first.has(from)) this.twin.set(first.get(from), to);
      else first.set(from, to);
    }
  }

  // the outputs of n lanes, each a Float64Array; what enters is a number, or an array of n
  run(entering, n) {
    const values = new Array(this.size);
    const free = [];
    const shared = new Set();
    for (const [k, name] of this.enters.entries()) {
      const x = entering[name];
      if (x === undefined) throw new Error(`no input ${name}`);
      values[k] = typeof x === "number" ? Float64Array.of(x) : x;
      shared.add(values[k]);
    }
    for (const [k, x] of this.constants.entries()) values[this.enters.length + k] = Float64Array.of(x);
    const room = (wide) => (wide ? (free.pop() ?? new Float64Array(n)) : new Float64Array(1));
    const wide = n > 1;
    for (const [s, [kind, to, i, j, k]] of this.steps.entries()) {
      if (values[to] === undefined) {
        const a = values[i], b = kind === PICK ? undefined : values[j], c = kind === PICK ? undefined : values[k];
        const many = wide && (a.length > 1 || b?.length > 1 || c?.length > 1);
        const r = (values[to] = room(many));
        const count = many ? n : 1;
        // the place of a lane in what is one number for all is 0
        const p = a.length > 1 ? -1 : 0, q = b?.length > 1 ? -1 : 0, m = c?.length > 1 ? -1 : 0;
        switch (kind) {
          case 0: for (let l = 0; l < count; l++) r[l] = a[l & p] + b[l & q]; break;
          case 1: for (let l = 0; l < count; l++) r[l] = a[l & p] - b[l & q]; break;
          case 2: for (let l = 0; l < count; l++) r[l] = a[l & p] * b[l & q]; break;
          case 3: for (let l = 0; l < count; l++) r[l] = a[l & p] / b[l & q]; break;
          case 4: for (let l = 0; l < count; l++) r[l] = -a[l]; break;
          case 5: for (let l = 0; l < count; l++) r[l] = Math.abs(a[l]); break;
          case 6: for (let l = 0; l < count; l++) r[l] = binade(a[l]); break;
          case 7: for (let l = 0; l < count; l++) r[l] = Math.sqrt(a[l]); break;
          case 8:
          case 9: {
            const twin = this.twin.get(to);
            const other = twin === undefined ? null : (values[twin] = room(many));
            for (let l = 0; l < count; l++) {
              sincos(a[l]);
              r[l] = pair[kind - 8];
              if (other) other[l] = pair[9 - kind];
            }
            break;
          }
          case 10: for (let l = 0; l < count; l++) r[l] = atan2(a[l & p], b[l & q]); break;
          case PICK: for (let l = 0; l < count; l++) r[l] = picked((knot) => a[l] > knot, this.lists[j], this.lists[k]); break;
          default: for (let l = 0; l < count; l++) r[l] = a[l & p] > 0 ? b[l & q] : c[l & m];
        }
      }
      for (const from of kind === PICK ? [i] : [i, j, k]) {
        if (from === undefined || this.last[from] !== s) continue;
        const x = values[from];
        if (x?.length > 1 && !shared.has(x)) free.push(x);
        values[from] = null;
      }
    }
    return this.outputs.map((k) => (values[k].length === n ? values[k] : new Float64Array(n).fill(values[k][0])));
  }

  // the outputs of one lane; what enters is a number
  one(entering) {
    const v = (this.room ??= new Float64Array(this.size));
    let k = 0;
    for (const name of this.enters) v[k++] = entering[name];
    for (const x of this.constants) v[k++] = x;
    const code = this.operations;
    for (let i = 0; i < code.length; k++) {
      const kind = code[i], a = v[code[i + 1]];
      switch (kind) {
        case 0: v[k] = a + v[code[i + 2]]; break;
        case 1: v[k] = a - v[code[i + 2]]; break;
        case 2: v[k] = a * v[code[i + 2]]; break;
        case 3: v[k] = a / v[code[i + 2]]; break;
        case 4: v[k] = -a; break;
        case 5: v[k] = Math.abs(a); break;
        case 6: v[k] = binade(a); break;
        case 7: v[k] = Math.sqrt(a); break;
        case 8: v[k] = sincos(a)[0]; break;
        case 9: v[k] = sincos(a)[1]; break;
        case 10: v[k] = atan2(a, v[code[i + 2]]); break;
        case PICK: v[k] = picked((knot) => a > knot, this.lists[code[i + 2]], this.lists[code[i + 3]]); break;
        default: v[k] = a > 0 ? v[code[i + 2]] : v[code[i + 3]];
      }
      i += 1 + ARITY[kind];
    }
    return Float64Array.from(this.outputs, (to) => v[to]);
  }

  // the outputs of one lane in 32 digits, [high, low] each; what enters is a number, or such a pair
  twice(entering) {
    const values = this.enters.map((name) => (typeof entering[name] === "number" ? [entering[name], 0] : entering[name]));
    for (const x of this.constants) values.push([x, 0]);
    for (const [kind, to, ...from] of this.steps) {
      if (kind === PICK) {
        const at = values[from[0]];
        values[to] = [picked((knot) => two.sub(at, [knot, 0])[0] > 0, this.lists[from[1]], this.lists[from[2]]), 0];
      } else values[to] = two[KINDS[kind]](...from.map((k) => values[k]));
    }
    return this.outputs.map((k) => values[k]);
  }
}
