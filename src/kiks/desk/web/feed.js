/* The feed: one WebSocket per page, shared by all its components.

       import { pageFeed } from "kiks-desk";
       const feed = pageFeed();
       const stop = feed.on("frame", (frame) => console.log(frame.time_s, frame.robot(0).proximity));

   feed.scene       the newest scene message (arena, robots with their looks, bodies) or null
   feed.frame       the newest frame (see frame.js) or null; it always belongs to feed.scene
   feed.bar         the newest description of the time bar (see time_bar.js) or null
   feed.board       the newest score (see board.js) or null
   feed.connection  "connecting", "open", "lost" (it reconnects by itself), "away" (the same, of a desk in a room that is
                    closed or lost for a minute) or "gone" (another desk is closed or lost for so long: nothing reconnects)
   feed.engine      the engine (see engine.js) or null; it is loaded when the first has asked, and then "engine" comes
   feed.on(what, callback) subscribes to "scene", "shapes", "bar", "board", "frame", "engine", "connection" or "error" (a
                    message of the server) and returns a function that unsubscribes.
   feed.send(object) sends a message and returns whether there was a connection.

   A hidden page does not acknowledge frames: the server pauses, and sends the newest frame when the page is visible
   again.

   When a desk has ended, any user of its computer may listen at its port. So only a server that knows the desk's secret,
   which comes with each scene and is never sent back, is the desk. NiceGUI's connection waits for that, because it loads
   the page again when its server asks for it. */

import { loadEngine } from "./engine.js";
import { Frame } from "./frame.js";

const EVENTS = ["scene", "shapes", "bar", "board", "frame", "engine", "connection", "error"];
/** Number of frames for one acknowledgement, which costs the server a tenth of a frame. */
const ACKNOWLEDGED_TOGETHER = 2;
const FIRST_PAUSE_MS = 250;
const LONGEST_PAUSE_MS = 5000;
/** How long the page tries to find its desk again. */
const LONGEST_LOSS_MS = 60_000;
/** Code with which the server closes a socket whose token it does not know any more: the page then says so. */
const REFUSED = 1008;
/** Longest period between two frames that is interpolated; beyond it, things would seem to lag. */
const LONGEST_INTERVAL_MS = 120;

export class Feed {
  constructor(path = "/desk/feed") {
    this.path = path;
    this.scene = null;
    this.frame = null;
    this.bar = this.board = this._engine = this._loading = null;
    this.connection = "connecting";
    this.frames_received = 0;
    this.bytes_received = 0;
    this._listeners = Object.fromEntries(EVENTS.map((what) => [what, new Set()]));
    this._pause_ms = FIRST_PAUSE_MS;
    this._secret = null;
    this._lost_ms = null;
    this._unacknowledged = 0;
    document.addEventListener("visibilitychange", () => this._wake());
    addEventListener("online", () => this._wake());
    this._connect();
  }

  get engine() {
    this._loading ??= this._loadEngine();
    return this._engine;
  }

  /** Load the engine after a picture of the screen has been painted without it. If it does not come, all else goes on, and
      it is asked for again when the desk is found again. */
  async _loadEngine() {
    await new Promise((done) => requestAnimationFrame(() => setTimeout(done)));
    try {
      const answer = await fetch(new URL("engine.wasm", new URL(this.path, location.href)));
      if (!answer.ok) throw new Error(`the desk has answered ${answer.status}`);
      this._engine = await loadEngine(await answer.arrayBuffer());
    } catch (error) {
      console.warn(`There is no light of lamps, as the engine did not come: ${error.message}`);
      return;
    }
    this._emit("engine", this._engine);
  }

  on(what, callback) {
    this._listeners[what].add(callback);
    return () => this._listeners[what].delete(callback);
  }

  send(message) {
    if (this._socket?.readyState !== WebSocket.OPEN) return false;
    this._socket.send(JSON.stringify(message));
    return true;
  }

  _connect() {
    this._timer = null;
    const address = new URL(this.path, location.href);
    address.protocol = address.protocol.replace("http", "ws");
    const socket = new WebSocket(address);
    socket.binaryType = "arraybuffer";
    this._socket = socket;
    socket.onopen = () => (this._unacknowledged = 0);
    socket.onmessage = (event) => (typeof event.data === "string" ? this._takeMessage(event.data) : this._takeFrame(event.data));
    socket.onclose = ({ code }) => {
      if (code === REFUSED) return location.reload();
      window.socket?.disconnect();
      this._lost_ms ??= performance.now();
      if (this.connection === "gone") return;
      const isLong = performance.now() - this._lost_ms > LONGEST_LOSS_MS;
      if (isLong && !this._isRoom) return this._giveUp();
      this._setConnection(isLong || this.connection === "away" ? "away" : "lost");
      this._timer = setTimeout(() => this._connect(), this._pause_ms);
      this._pause_ms = Math.min(2 * this._pause_ms, LONGEST_PAUSE_MS);
    };
  }

  _takeMessage(text) {
    const message = JSON.parse(text);
    if (message.kind === "scene") {
      if (this.connection !== "open" && !this._accept(message.secret)) return;
      this._isRoom = message.is_room;
      for (const robot of message.robots) Object.assign(robot, message.looks[robot.look]);
      this.scene = message;
      // If no thing has appeared or disappeared, keep the last frame, to avoid flicker.
      const { robot_count, body_count } = this.frame ?? {};
      if (robot_count !== message.robots.length || body_count !== message.bodies.length) this.frame = null;
      this._emit("scene", message);
    } else if (message.kind === "shapes" && this.scene) {
      this.scene.robots.forEach((robot, index) => (robot.shapes = message.robots[index] ?? robot.shapes));
      this._emit("shapes", this.scene);
    } else if (message.kind === "bar" || message.kind === "board") {
      this[message.kind] = message;
      this._emit(message.kind, message);
    } else if (message.kind === "error") {
      this._emit("error", message.text);
    } else if (message.kind === "gone") {
      // A room is opened again, maybe on another day.
      if (this._isRoom) this._setConnection("away");
      else this._giveUp();
    }
  }

  /** Go on with the server if it is the desk that this page came from, and return whether it is. */
  _accept(secret) {
    this._secret ??= secret;
    if (secret !== this._secret) {
      this._giveUp();
      return false;
    }
    this._pause_ms = FIRST_PAUSE_MS;
    this._lost_ms = null;
    if (!this._engine) this._loading = null;
    if (["lost", "away"].includes(this.connection)) window.socket?.connect();
    this._setConnection("open");
    return true;
  }

  /** Ask for nothing any more. */
  _giveUp() {
    this._setConnection("gone");
    this._socket.close();
    document.getElementById("popup")?.style.setProperty("display", "none"); // it says that NiceGUI tries again
  }

  _takeFrame(buffer) {
    this.frames_received++;
    this.bytes_received += buffer.byteLength;
    this._unacknowledged++;
    if (!document.hidden && this._unacknowledged >= ACKNOWLEDGED_TOGETHER) this._acknowledge();
    const frame = new Frame(buffer, performance.now());
    if (!this.scene || frame.scene !== this.scene.scene) return;
    const before = this.frame;
    if (before) {
      before.previous = null;
      frame.previous = before;
      frame.interval_ms = Math.min(frame.arrived_ms - before.arrived_ms, LONGEST_INTERVAL_MS);
    }
    this.frame = frame;
    this._emit("frame", frame);
  }

  _acknowledge() {
    if (this._unacknowledged && this.send({ kind: "ack", count: this._unacknowledged })) this._unacknowledged = 0;
  }

  _wake() {
    if (document.hidden) return;
    this._acknowledge();
    if (this._timer === null || this._timer === undefined) return;
    clearTimeout(this._timer);
    this._connect();
  }

  _setConnection(connection) {
    this.connection = connection;
    this._emit("connection", connection);
  }

  _emit(what, news) {
    for (const callback of [...this._listeners[what]]) callback(news);
  }
}

let feed = null;

/** Give the components of this page another feed, before the first of them is made. */
export function setPageFeed(other) {
  feed = other;
}

/** Return the feed of this page; the first caller's path counts. */
export function pageFeed(path) {
  feed ??= new Feed(path);
  return feed;
}
