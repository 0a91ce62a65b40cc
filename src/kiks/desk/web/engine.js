/* The engine in the browser: the kernels of KiKS, compiled to WebAssembly (kiks/engine/webassembly.py), and their memory.

       const engine = await loadEngine(bytes);
       const out = engine.array(8, [1, 8]);
       engine.call("read_all", scene, tick, time_ns, out, other);

   An argument is a number, an array {at, shape, size} in the engine's memory without gaps (its address, its shape and the
   bytes of an element), or a list of these for a tuple. */

const PAGE_BYTES = 65536;
const STACK_BYTES = 1 << 20;
/** Room above all that is allocated, for what a kernel asks for until it returns. */
const HEAP_BYTES = 32 << 20;
const ALIGNMENT = 64;
/** What a kernel returns that has raised nothing. */
const OK = [0, -2];

/** Make an engine of a module's bytes. Others may bring functions for it: see `add`. */
export async function loadEngine(bytes) {
  const module = await WebAssembly.compile(bytes);
  const about = describe(module), pages = Math.ceil((about.end + STACK_BYTES + HEAP_BYTES) / PAGE_BYTES);
  const memory = new WebAssembly.Memory({ initial: pages, maximum: 65536 });
  const table = new WebAssembly.Table({ initial: 1, element: "anyfunc" });
  const top = up(about.end) + STACK_BYTES;
  const stack = new WebAssembly.Global({ value: "i32", mutable: true }, top);
  const env = { __linear_memory: memory, __stack_pointer: stack, __indirect_function_table: table };
  const { exports } = await WebAssembly.instantiate(module, { env });
  return new Engine(env, exports, about, top);
}

function describe(module) {
  return JSON.parse(new TextDecoder().decode(WebAssembly.Module.customSections(module, "kiks")[0]));
}

const up = (address) => Math.ceil(address / ALIGNMENT) * ALIGNMENT;

export class Engine {
  constructor(env, exports, about, top) {
    this._env = env;
    this.memory = env.__linear_memory;
    /** What the build says of the module: layouts of records, and more. */
    this.about = about;
    this._exports = exports;
    /** What has its own heap: the second half of the room, as the engine's kernels call it. */
    this._added = [];
    this._stack = this._top = top;
    this._size = this.memory.buffer.byteLength;
    this._returned = this.allocate(256);
  }

  /** Take another module, whose functions can then be found by `addressOf`. */
  async add(bytes) {
    const module = await WebAssembly.compile(bytes), { exports } = await WebAssembly.instantiate(module, { env: this._env });
    this._added.push(exports);
    return exports;
  }

  /** The address at which kernels call an exported function: its place in the table. */
  addressOf(name, exports = this._exports) {
    const table = this._env.__indirect_function_table, address = table.grow(1);
    table.set(address, exports[name]);
    return address;
  }

  /** The first address that is free; `release` takes it to free all that was allocated since. */
  get top() { return this._top; }

  release(top) { this._top = top; }

  /** Return the address of some memory, all zeros. */
  allocate(byteCount) {
    const address = this._top;
    this._top = up(address + byteCount);
    this._makeRoom(HEAP_BYTES);
    this.bytes(address, byteCount).fill(0);
    return address;
  }

  /** Let there be so much memory above all that is allocated. */
  _makeRoom(byteCount) {
    const lacking = this._top + byteCount - this._size;
    if (lacking <= 0) return;
    this.memory.grow(Math.ceil(lacking / PAGE_BYTES));
    this._size = this.memory.buffer.byteLength;
  }

  /** Return an array of elements of some bytes: new memory, or what is at an address. */
  array(size, shape, at = this.allocate(size * shape.reduce((product, count) => product * count, 1))) {
    return { at, shape, size };
  }

  /** A view of memory, which holds until more is allocated. */
  bytes(address, length) { return new Uint8Array(this.memory.buffer, address, length); }

  /** Call a kernel. Returns what it returns: null, a number, or a list of numbers. */
  call(name, ...values) {
    const flat = [this._returned, this._returned + 128], byteCount = flatten(values, this.about.arguments[name], flat);
    // What a kernel asks for is no larger than some of its arrays.
    this._makeRoom(HEAP_BYTES + 4 * byteCount);
    // A kernel that was stopped has left the stack as it was.
    this._env.__stack_pointer.value = this._stack;
    this._exports.set_heap(this._top);
    for (const { set_heap } of this._added) set_heap(this._top + HEAP_BYTES / 2);
    const status = this._exports[name](...flat);
    if (!OK.includes(status)) throw new Error(`the kernel ${name} has failed with status ${status}`);
    return this._results(this.about.functions[name]);
  }

  _results(letters) {
    if (!letters) return null;
    const view = new DataView(this.memory.buffer, this._returned);
    const results = [...letters].map((letter, k) => (letter === "d" ? view.getFloat64(8 * k, true) : Number(view.getBigInt64(8 * k, true))));
    return results.length > 1 ? results : results[0];
  }
}

/** Add the arguments of a kernel for values to `flat`, as Numba passes them, converted by the letters of its signature.
    Returns the bytes of all arrays among them. It is done for each call of each kernel: so no lists are made on the way. */
function flatten(values, letters, flat) {
  const add = (value) => flat.push(letters[flat.length] === "l" ? BigInt(value) : Number(value));
  let sum = 0;
  for (const value of values) {
    if (typeof value !== "object") add(value);
    else if (Array.isArray(value)) sum += flatten(value, letters, flat);
    else {
      const { at, shape, size } = value, count = shape.reduce((product, length) => product * length, 1);
      for (const word of [0, 0, count, size, at]) add(word);
      for (const length of shape) add(length);
      shape.forEach((_, k) => add(shape.slice(k + 1).reduce((stride, length) => stride * length, size)));
      sum += size * count;
    }
  }
  return sum;
}
