/* What came to the engine in a run, out of its packed form (see kiks/recording/engine_inputs.py). */

/** What a moment is: a checkpoint, the begin of a segment, or, from `PATTERNS` on, a change of the words of a pattern. */
export const CHECK = 0;
export const SEGMENT = 1;
export const PATTERNS = 2;

/** The arrays that change, in the order in which patterns number them. */
export const CHANGING = ["robots", "bodies", "lamps", "shown"];

export const HASH_BYTES = 8;

/** Read inputs: for each moment its tick, what it is, and the place of its first value, or the number of its segment or
    checkpoint; patterns as lists of words, each the number of an array and a place in it; and all values. */
export function readInputs(head, bytes) {
  const reader = new Reader(bytes), count = head.moment_count;
  const ticks = sumUp(reader.numbers(count)), whats = reader.numbers(count);
  const hashes = Array.from({ length: head.check_count }, () => hexadecimal(reader.take(HASH_BYTES)));
  const patterns = head.patterns.map((pattern) => pattern.flatMap((runs, array) => wordsOf(runs).map((word) => ({ array, word }))));
  const firsts = new Uint32Array(count), places = [0, 0, 0];
  for (let k = 0; k < count; k++) {
    const kind = Math.min(whats[k], PATTERNS);
    firsts[k] = places[kind];
    places[kind] += kind === PATTERNS ? patterns[whats[k] - PATTERNS].length : 1;
  }
  const values = readValues(reader, head.is_summed, patterns, whats, places[PATTERNS]);
  const contents = head.contents.map((length) => reader.take(length));
  return { ticks, whats, firsts, patterns, values, hashes, contents, segments: head.segments, begin_ns: head.begin_ns };
}

class Reader {
  constructor(bytes) {
    this._bytes = bytes;
    this._at = 0;
  }

  take(count) { return this._bytes.subarray(this._at, (this._at += count)); }

  /** Numbers of four bytes, of which the first bytes come first. */
  numbers(count) {
    const planes = this.take(4 * count), numbers = new Uint32Array(count);
    for (let k = 0; k < count; k++)
      numbers[k] = planes[k] | (planes[k + count] << 8) | (planes[k + 2 * count] << 16) | (planes[k + 3 * count] << 24);
    return numbers;
  }
}

/** Values come word by word, in the order in which patterns name the words first. */
function readValues(reader, isSummed, patterns, whats, count) {
  const columns = new Map();
  const of = patterns.map((pattern) => pattern.map(({ array, word }) => {
    const name = `${array} ${word}`;
    if (!columns.has(name)) columns.set(name, { count: 0, next: 0 });
    return columns.get(name);
  }));
  for (const what of whats) if (what >= PATTERNS) for (const column of of[what - PATTERNS]) column.count++;
  [...columns.values()].forEach((column, k) => {
    column.values = reader.numbers(column.count);
    if (isSummed[k] === "1") sumUp(column.values.map((value) => (value >>> 1) ^ -(value & 1)), column.values);
  });
  const values = new Uint32Array(count);
  let at = 0;
  for (const what of whats)
    if (what >= PATTERNS) for (const column of of[what - PATTERNS]) values[at++] = column.values[column.next++];
  return values;
}

function sumUp(changes, sums = changes) {
  for (let k = 0, sum = 0; k < changes.length; k++) sums[k] = sum = (sum + changes[k]) >>> 0;
  return sums;
}

/** Words of runs: 3, 4 for 3, 2. */
function wordsOf(runs) {
  const words = [];
  for (let k = 0; k < runs.length; k += 2) for (let n = 0; n < runs[k + 1]; n++) words.push(runs[k] + n);
  return words;
}

export const hexadecimal = (bytes) => Array.from(bytes, (byte) => byte.toString(16).padStart(2, "0")).join("");
