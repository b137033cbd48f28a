// A family of shapes, all alphas at once, as recon/page/family.py packs it: no drawing here.
"use strict";

async function unpack(table, text) {
  const binary = atob(text.trim());
  const zipped = new Uint8Array(binary.length);
  for (let i = 0; i < zipped.length; i++) zipped[i] = binary.charCodeAt(i);
  const stream = new Blob([zipped]).stream().pipeThrough(new DecompressionStream("gzip"));
  const bytes = new Uint8Array(await new Response(stream).arrayBuffer());
  const types = { Float64Array, Float32Array, Int32Array, Uint8Array };
  const arrays = {};
  let at = 0;
  for (const { name, type, rows, columns } of table) {
    const size = types[type].BYTES_PER_ELEMENT, total = rows * columns;
    const flat = new Uint8Array(total * size);
    for (let plane = 0; plane < size; plane++) {
      for (let i = 0, to = plane; i < total; i++, to += size) flat[to] = bytes[at++];
    }
    const values = new types[type](flat.buffer);
    arrays[name] = Array.from({ length: columns }, (_, k) => values.subarray(k * rows, (k + 1) * rows));
    if (type === "Int32Array") for (const column of arrays[name]) for (let i = 1; i < rows; i++) column[i] += column[i - 1];
  }
  return arrays; // each a list of columns
}

function interleave(columns) {
  const width = columns.length, rows = columns[0].length;
  const out = new columns[0].constructor(rows * width);
  columns.forEach((column, k) => { for (let i = 0; i < rows; i++) out[i * width + k] = column[i]; });
  return out;
}

// How many of the ascending values are at most x, compared as doubles.
function countUpTo(values, x) {
  let low = 0, high = values.length;
  while (low < high) {
    const middle = (low + high) >>> 1;
    if (values[middle] <= x) low = middle + 1; else high = middle;
  }
  return low;
}

// The order that sorts ranks below a limit, equal ones as they are: by counting.
function ascending(ranks, limit) {
  const at = new Int32Array(limit + 2), order = new Int32Array(ranks.length);
  for (const rank of ranks) at[rank + 1]++;
  for (let rank = 0; rank < limit; rank++) at[rank + 1] += at[rank];
  for (let i = 0; i < ranks.length; i++) order[at[ranks[i]]++] = i;
  return order;
}

function taken(values, order) {
  const out = new Int32Array(order.length);
  for (let i = 0; i < order.length; i++) out[i] = values[order[i]];
  return out;
}

// Facets stand in bins, by the rank from which on they are there, and in each bin in the order in which they go, the last one
// first: of a bin that is there as a whole, the exposed facets are the first ones. So a step costs as much as what it draws.
const BINS = 512;

class Family {
  constructor(arrays) {
    this.critical = arrays.critical[0];
    this.betti = arrays.betti;
    this.width = arrays.facets.length;
    const [first, , upper] = arrays.intervals, n = this.critical.length;
    this.ranks = Math.ceil(n / BINS); // in a bin
    const leaving = ascending(upper.map((rank) => n - rank), n);
    const bins = taken(first, leaving).map((rank) => Math.floor(rank / this.ranks));
    const order = taken(leaving, ascending(bins, BINS));
    [this.first, this.lower, this.upper] = arrays.intervals.map((column) => taken(column, order));
    this.corners = interleave(arrays.facets.map((column) => taken(column, order)));
    this.ends = new Int32Array(BINS); // where each bin ends
    for (const bin of bins) this.ends[bin]++;
    for (let bin = 1; bin < BINS; bin++) this.ends[bin] += this.ends[bin - 1];
    this.cells = arrays.cells;
    this.entries = arrays.entries && arrays.entries[0];
  }

  rank(alpha) { return countUpTo(this.critical, alpha); }

  // A facet is singular from its first bound on, regular from its lower one, interior from its upper one.
  // Write the corners of the facets of each shown class into target: singular ones from the end backwards, regular ones
  // from the beginning, interior ones after these; give counts, starts and sizes.
  select(alpha, [singular, regular, interior], target) {
    const r = this.rank(alpha), { width, corners, first, lower, upper, ranks, ends } = this, gone = [];
    let fore = 0, back = target.length, alone = 0, between = 0, inside = 0;
    for (let bin = 0, i = 0; bin * ranks < r; bin++) {
      const whole = (bin + 1) * ranks <= r, to = ends[bin];
      for (; i < to && upper[i] >= r; i++) {
        if (!whole && first[i] >= r) continue;
        if (lower[i] < r) {
          between++;
          if (regular) for (let k = 0, at = i * width; k < width; k++) target[fore++] = corners[at++];
        } else {
          alone++;
          if (singular) for (let k = width, at = i * width + width; k > 0; k--) target[--back] = corners[--at];
        }
      }
      inside += to - i; // what has gone was there
      gone.push([i * width, to * width]);
      i = to;
    }
    let end = fore;
    if (interior) for (const [from, to] of gone) {
      target.set(corners.subarray(from, to), end);
      end += to - from;
    }
    return { counts: [alone, between, inside], starts: [back, 0, fore], sizes: [target.length - back, fore, end - fore] };
  }

  selectCells(alpha, target) {
    const r = this.rank(alpha);
    let at = 0;
    for (let i = 0; i < this.entries.length; i++) if (this.entries[i] < r) for (const corner of this.cells) target[at++] = corner[i];
    return at;
  }

  // What the library's boundary(alpha) gives: rows of facets, singular ones ascending, and which are singular.
  boundary(alpha) {
    const r = this.rank(alpha), { width, corners } = this, facets = [], singular = [];
    for (let i = 0; i < this.first.length; i++) {
      const kind = (this.first[i] < r) + (this.lower[i] < r) + (this.upper[i] < r);
      if (kind !== 1 && kind !== 2) continue;
      const row = Array.from(corners.subarray(i * width, (i + 1) * width));
      facets.push(kind === 2 ? row : row.sort((a, b) => a - b));
      singular.push(kind === 1);
    }
    return { facets, singular };
  }

  // The least alpha with an exposed facet at which it is not long gone: the next one at or after alpha, else the last before.
  nearestExposed(alpha) {
    const r = this.rank(alpha), n = this.critical.length;
    let after = n, before = -1;
    for (let i = 0; i < this.first.length; i++) {
      const from = this.first[i], to = Math.min(this.upper[i], n);
      if (from >= to) continue;
      if (from >= r && from < after) after = from;
      if (to <= r && to - 1 > before) before = to - 1;
    }
    return after < n ? this.critical[after] : before >= 0 ? this.critical[before] : null;
  }
}

// Places 0 .. 1 along the slider: logarithmic in both directions, linear where alpha is small. What comes after the last
// change of a Betti number, a few huge simplices at the hull, gets no more than the last eighth.
class Scale {
  constructor({ critical, betti }) {
    const sizes = [], last = Math.max(0, countUpTo(critical, Number.MAX_VALUE) - 1), step = Math.max(1, Math.floor(critical.length / 20000));
    for (let i = 0; i <= last; i += step) if (critical[i] !== 0) sizes.push(Math.abs(critical[i]));
    sizes.sort((a, b) => a - b);
    this.unit = sizes.length ? sizes[Math.floor(0.1 * (sizes.length - 1))] : 1;
    let change = last;
    while (change > 0 && betti.every((curve) => curve[change] === curve[change - 1])) change--;
    const [low, knee, high] = [critical[0], critical[change], critical[last]].map((alpha) => Math.asinh(alpha / this.unit));
    const margin = 0.015 * (high - low) || 1;
    const natural = (knee - low + margin) / (high - low + 2 * margin);
    const early = change === last || change === 0 || natural > 0.875 ? natural : 0.875;
    this.knots = [[0, low - margin], [early, knee], [1, high + margin]];
  }
  alpha(x) {
    const [from, to] = x < this.knots[1][0] ? this.knots.slice(0, 2) : this.knots.slice(1);
    return this.unit * Math.sinh(from[1] + ((x - from[0]) / (to[0] - from[0])) * (to[1] - from[1]));
  }
  place(alpha) {
    const y = Math.asinh(alpha / this.unit), [from, to] = y < this.knots[1][1] ? this.knots.slice(0, 2) : this.knots.slice(1);
    return Math.min(1, Math.max(0, from[0] + ((y - from[1]) / (to[1] - from[1])) * (to[0] - from[0])));
  }
}
