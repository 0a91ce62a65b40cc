/* Keeps what a person types in the editor of programs in this browser until the server has saved it: the connection may be
   away, the page may load itself again, and the server may end. What is kept is offered to the server, which puts it
   together with what it has, saves it, and says so (`forget`). Each page keeps its own: a person may have two of them. */

const LOOK_MS = 250;
/** How long a text must stay as it is, and not be saved, before it is offered: the server saves at each pause. */
const LOST_MS = 2000;

export default {
  template: "<span hidden></span>",
  props: { editor: Number, name: String, saved: String },
  mounted() {
    this.prefix = `kiks-typed ${location.pathname} `;
    this.page = Math.random().toString(36).slice(2);
    this.hasOfferedEarlier = false;
    this.timer = setInterval(() => this.look(), LOOK_MS);
  },
  unmounted() { clearInterval(this.timer); },
  methods: {
    look() {
      if (!window.did_handshake) return;
      if (!this.hasOfferedEarlier) this.offerEarlier();
      const text = this.text(), key = `${this.prefix}${this.page} ${this.name}`;
      if (text === undefined || !this.name) return;
      if (text === this.saved) return this.remove(key);
      if (text !== this.last || key !== this.lastKey) {
        this.last = text;
        this.lastKey = key;
        this.since_ms = performance.now();
        this.offeredTo = null;
        return this.keep(key, { name: this.name, base: this.saved ?? null, text });
      }
      const connection = window.socket?.connected && window.socket.id;
      if (connection && connection !== this.offeredTo && performance.now() - this.since_ms > LOST_MS) {
        this.offeredTo = connection;
        this.$emit("offer", { name: this.name, base: this.saved ?? null, text });
      }
    },
    /** Return the text in the editor; one that is hidden has left it with NiceGUI. */
    text() {
      if (!this.editor) return undefined;
      return getElement(this.editor)?.editor?.state.doc.toString() ?? mounted_app.elements[this.editor]?.props.value;
    },
    /** Offer what earlier pages have kept, and what others of this desk keep now. */
    offerEarlier() {
      this.hasOfferedEarlier = true;
      for (const [, kept] of this.all()) this.$emit("offer", kept);
    },
    forget(name, text) {
      for (const [key, kept] of this.all()) if (kept.name === name && kept.text === text) this.remove(key);
    },
    // A browser may have no storage, or a full one: then it keeps nothing.
    all() {
      try {
        const keys = Object.keys(localStorage).filter((key) => key.startsWith(this.prefix));
        return keys.map((key) => [key, JSON.parse(localStorage.getItem(key))]);
      } catch { return []; }
    },
    keep(key, kept) { try { localStorage.setItem(key, JSON.stringify(kept)); } catch { /* full */ } },
    remove(key) { try { localStorage.removeItem(key); } catch { /* none */ } },
  },
};
