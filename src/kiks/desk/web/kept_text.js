/* Keeps what a person types in the editor of programs in this browser until the server has saved it: the connection may be
   away, the page may load itself again, and the server may end. What is kept is offered to the server, which puts it
   together with what it has, saves it, and says so (`forget`). */

const LOOK_MS = 250;
/** How long a text must stay as it is, and not be saved, before it is offered: the server saves at each pause. */
const LOST_MS = 2000;

export default {
  template: "<span hidden></span>",
  props: { editor: Number, name: String, saved: String },
  mounted() {
    this.prefix = `kiks-typed ${location.pathname} `;
    /** Texts of an earlier page, by their keys, until the server has taken them; null before they are looked for. */
    this.earlier = null;
    this.timer = setInterval(() => this.look(), LOOK_MS);
  },
  unmounted() { clearInterval(this.timer); },
  methods: {
    look() {
      if (!window.did_handshake) return;
      this.earlier ??= this.offerEarlier();
      const text = this.text(), key = this.prefix + this.name;
      if (this.earlier.get(key) === this.saved) this.earlier.delete(key);
      if (text === undefined || !this.name || this.earlier.has(key)) return;
      if (text === this.saved) return this.remove(key);
      if (text !== this.last || key !== this.lastKey) {
        this.last = text;
        this.lastKey = key;
        this.since_ms = performance.now();
        this.offeredTo = null;
        return this.keep(key, { base: this.saved ?? null, text });
      }
      const connection = window.socket?.connected && window.socket.id;
      if (connection && connection !== this.offeredTo && performance.now() - this.since_ms > LOST_MS) {
        this.offeredTo = connection;
        this.offer(key, { base: this.saved ?? null, text });
      }
    },
    /** Return the text in the editor; one that is hidden has left it with NiceGUI. */
    text() {
      if (!this.editor) return undefined;
      return getElement(this.editor)?.editor?.state.doc.toString() ?? mounted_app.elements[this.editor]?.props.value;
    },
    offerEarlier() {
      const found = new Map();
      for (const key of this.keys().filter((key) => key.startsWith(this.prefix))) {
        const kept = JSON.parse(localStorage.getItem(key));
        found.set(key, kept.text);
        this.offer(key, kept);
      }
      return found;
    },
    offer(key, { base, text }) { this.$emit("offer", { name: key.slice(this.prefix.length), base, text }); },
    forget(name, text) {
      const key = this.prefix + name;
      if (this.earlier?.get(key) === text) this.earlier.delete(key);
      this.remove(key);
    },
    // A browser may have no storage, or a full one: then it keeps nothing.
    keys() { try { return Object.keys(localStorage); } catch { return []; } },
    keep(key, kept) { try { localStorage.setItem(key, JSON.stringify(kept)); } catch { /* full */ } },
    remove(key) { try { localStorage.removeItem(key); } catch { /* none */ } },
  },
};
