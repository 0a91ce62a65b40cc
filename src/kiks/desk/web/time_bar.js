/* The time bar's slider: the past of the world from its beginning to now, with marks where something happened.

   The messages "bar" of the server carry the span and the marks; frames carry the time of the shown world. A drag sends
   "seek". */

import { clockText, pageFeed } from "kiks-desk";

const STEP_S = 0.1;
const LONG_STEP_S = 1;
/** Distance within which the pointer is at a mark [px]. */
const NEAR_PX = 7;
/** How long the thumb stays where it was let go, until a frame is of that time [ms]. */
const PATIENCE_MS = 1500;

export default {
  template: `
    <div class="kiks-bar" data-testid="time-bar" v-show="bar && bar.begin_s !== null">
      <span ref="now" class="kiks-bar-time" data-testid="bar-now">0:00.00</span>
      <div ref="track" class="kiks-bar-track" tabindex="0" role="slider" data-testid="time-slider"
           aria-label="Time. Arrow keys: 0.1 seconds, Page Up and Page Down: 1 second, Home and End: from begin to end"
           @pointerdown="take" @pointermove="move" @pointerup="release" @pointercancel="release" @pointerleave="leave"
           @keydown="press">
        <i v-for="(mark, k) in marks" :key="k" :class="'kiks-bar-mark kiks-bar-' + mark[1]"
           :style="{ left: percentOf(mark[0]) + '%' }"></i>
        <div class="kiks-bar-rail"><div ref="fill" class="kiks-bar-fill"></div></div>
        <div ref="thumb" class="kiks-bar-thumb"></div>
        <div ref="tip" class="kiks-bar-tip" role="status" data-testid="bar-tip" hidden></div>
      </div>
      <span ref="end" class="kiks-bar-time" data-testid="bar-end">0:00.00</span>
    </div>`,
  props: { feed: { type: String, default: "/desk/feed" } },
  data: () => ({ bar: null, marks: [], end_s: 0 }),
  mounted() {
    const feed = pageFeed(this.feed);
    this.page_feed = feed;
    this.wanted_s = null;
    this.isHeld = false;
    this.stops = [
      feed.on("bar", (bar) => this.takeBar(bar)),
      feed.on("frame", (frame) => this.show(frame.time_s)),
    ];
    if (feed.bar) this.takeBar(feed.bar);
  },
  unmounted() {
    for (const stop of this.stops) stop();
    cancelAnimationFrame(this.sending);
  },
  methods: {
    takeBar(bar) {
      this.bar = bar;
      this.marks = bar.marks;
      this.show(this.page_feed.frame?.time_s ?? bar.begin_s ?? 0);
    },

    /** Show the time of the world, or that to which the thumb was dragged. */
    show(time_s) {
      const bar = this.bar;
      if (!bar || bar.begin_s === null) return;
      this.time_s = time_s;
      const end_s = bar.end_s ?? Math.max(time_s, bar.begin_s);
      // Marks lie elsewhere when the end has moved by a pixel or so.
      if (bar.end_s !== null || Math.abs(end_s - this.end_s) * 500 > end_s - bar.begin_s) this.end_s = end_s;
      this.last_s = end_s;
      const isThere = this.wanted_s === null || Math.abs(this.wanted_s - time_s) < 0.005;
      if (!this.isHeld && (isThere || performance.now() > this.until_ms)) this.wanted_s = null;
      const shown_s = Math.min(Math.max(this.wanted_s ?? time_s, bar.begin_s), end_s);
      const { track, fill, thumb, now, end } = this.$refs;
      fill.style.width = thumb.style.left = `${this.percentOf(shown_s, end_s)}%`;
      now.textContent = clockText(shown_s);
      end.textContent = clockText(end_s);
      track.setAttribute("aria-valuemin", bar.begin_s.toFixed(2));
      track.setAttribute("aria-valuemax", end_s.toFixed(2));
      track.setAttribute("aria-valuenow", shown_s.toFixed(2));
      track.setAttribute("aria-valuetext", `${clockText(shown_s)} of ${clockText(end_s)}`);
    },

    /** Where a time is on the bar [%]; marks are placed by an end that moves now and then only. */
    percentOf(time_s, end_s = this.end_s) {
      const { begin_s } = this.bar;
      return end_s > begin_s ? 100 * Math.min(1, Math.max(0, (time_s - begin_s) / (end_s - begin_s))) : 100;
    },

    timeAt(event) {
      const { left, width } = this.$refs.track.getBoundingClientRect();
      const share = Math.min(1, Math.max(0, (event.clientX - left) / width));
      return this.bar.begin_s + share * (this.last_s - this.bar.begin_s);
    },

    seek(time_s) {
      this.wanted_s = Math.min(Math.max(time_s, this.bar.begin_s), this.last_s);
      this.until_ms = performance.now() + PATIENCE_MS;
      this.show(this.time_s);
      this.sending ??= requestAnimationFrame(() => {
        this.sending = null;
        this.page_feed.send({ kind: "seek", time_s: this.wanted_s ?? time_s });
      });
    },

    take(event) {
      if (event.button !== 0 || !this.bar) return;
      this.$refs.track.setPointerCapture(event.pointerId);
      this.isHeld = true;
      this.seek(this.markNear(event)?.[0] ?? this.timeAt(event));
      this.tell(event);
    },

    move(event) {
      if (this.isHeld) this.seek(this.timeAt(event));
      this.tell(event);
    },

    release(event) {
      this.isHeld = false;
      if (event.pointerType !== "mouse") this.leave();
    },

    leave() {
      if (!this.isHeld) this.$refs.tip.hidden = true;
    },

    markNear(event) {
      const { left, width } = this.$refs.track.getBoundingClientRect();
      let nearest = null, least = NEAR_PX;
      for (const mark of this.marks) {
        const gap = Math.abs(left + (this.percentOf(mark[0]) / 100) * width - event.clientX);
        if (gap < least) [nearest, least] = [mark, gap];
      }
      return nearest;
    },

    /** Show the time at the pointer, and what happened there. */
    tell(event) {
      const { track, tip } = this.$refs, { left, width } = track.getBoundingClientRect();
      if (!this.bar) return;
      const mark = this.isHeld ? null : this.markNear(event);
      tip.textContent = mark ? `${clockText(mark[0])}  ${mark[2]}` : clockText(this.timeAt(event));
      tip.hidden = false;
      const half = tip.offsetWidth / 2, at = event.clientX - left;
      tip.style.left = `${Math.min(Math.max(at, half - 48), width - half + 48)}px`;
    },

    press(event) {
      if (!this.bar || event.ctrlKey || event.altKey || event.metaKey) return;
      const now_s = this.wanted_s ?? this.time_s, step_s = event.shiftKey ? LONG_STEP_S : STEP_S;
      const wanted_s = {
        ArrowLeft: now_s - step_s, ArrowDown: now_s - step_s, ArrowRight: now_s + step_s, ArrowUp: now_s + step_s,
        PageDown: now_s - LONG_STEP_S, PageUp: now_s + LONG_STEP_S, Home: this.bar.begin_s, End: this.last_s,
      }[event.key];
      if (wanted_s === undefined) return;
      event.preventDefault();
      event.stopPropagation();
      this.seek(wanted_s);
    },
  },
};
