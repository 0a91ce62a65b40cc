/* The player of a recorded run: lets the feed show its times, one after the other. */

import { clockText } from "./clock.js";

const LEAP_S = 1;
/** Longest time between two pictures that counts [ms]: a hidden page gets none, and the run waits for it. */
const LONGEST_MS = 250;
const THUMB_PX = 16;

export class Player {
  /** `parts` is {play, slider, marks, clock, speed}, elements; `marks` is [[time_s, kind, height_px], ...]. */
  constructor(parts, feed, marks) {
    Object.assign(this, parts);
    this.feed = feed;
    this.time_s = feed.begin_s;
    this.isPlaying = false;
    this._times = marks;
    this._shown_s = NaN;
    Object.assign(this.slider, { min: feed.begin_s, max: feed.end_s, step: "any" });
    this.play.addEventListener("click", () => this.toggle());
    this.slider.addEventListener("input", () => this.seek(this.slider.valueAsNumber));
    document.addEventListener("keydown", (event) => this._press(event));
    new ResizeObserver(() => this.paintMarks()).observe(this.marks);
    requestAnimationFrame((now_ms) => this._tick(now_ms));
  }

  toggle() {
    this.isPlaying = !this.isPlaying;
    if (this.isPlaying && this.time_s >= this.feed.end_s) this.time_s = this.feed.begin_s;
    this._before_ms = undefined;
    this._label();
  }

  /** Go to a time. */
  seek(time_s) {
    this.time_s = Math.min(Math.max(time_s, this.feed.begin_s), this.feed.end_s);
  }

  _press(event) {
    const { key, target } = event;
    const isOther = target !== this.slider && target.closest("input, select, textarea, button, a, summary, [tabindex]");
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    if (key === " " && (!isOther || target.matches("canvas"))) this.toggle();
    else if (isOther) return;
    else if (key === "ArrowRight" || key === "ArrowLeft") {
      const way = key === "ArrowRight" ? 1 : -1;
      this.seek(event.shiftKey ? this.feed.neighbour(this.time_s, way) : this.time_s + way * LEAP_S);
    } else if (key === "Home") this.seek(this.feed.begin_s);
    else if (key === "End") this.seek(this.feed.end_s);
    else return;
    event.preventDefault();
  }

  _tick(now_ms) {
    requestAnimationFrame((later_ms) => this._tick(later_ms));
    if (this.isPlaying) {
      const passed_ms = Math.min(now_ms - (this._before_ms ?? now_ms), LONGEST_MS);
      this._before_ms = now_ms;
      this.seek(this.time_s + (passed_ms / 1000) * Number(this.speed.value));
      if (this.time_s >= this.feed.end_s) this.toggle();
    }
    if (this.time_s === this._shown_s) return;
    this._shown_s = this.time_s;
    this.feed.show(this.time_s);
    this.slider.value = this.time_s;
    this.slider.setAttribute("aria-valuetext", clockText(this.time_s));
    this.clock.textContent = clockText(this.time_s);
  }

  _label() {
    this.play.classList.toggle("playing", this.isPlaying);
    this.play.setAttribute("aria-label", this.isPlaying ? "Pause" : "Play");
    this.play.title = this.isPlaying ? "Pause (space)" : "Play (space)";
  }

  /** Draw the marks above the slider, in the colours of the page. */
  paintMarks() {
    const { clientWidth: width, clientHeight: height } = this.marks, ratio = devicePixelRatio || 1;
    const { begin_s, end_s } = this.feed, context = this.marks.getContext("2d"), styles = getComputedStyle(this.marks);
    this.marks.width = width * ratio;
    this.marks.height = height * ratio;
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    for (const [time_s, kind] of this._times) {
      const share = end_s > begin_s ? (time_s - begin_s) / (end_s - begin_s) : 0;
      const mark_px = Number(styles.getPropertyValue(`--${kind}-px`));
      context.fillStyle = styles.getPropertyValue(`--${kind}`);
      context.fillRect(THUMB_PX / 2 + share * (width - THUMB_PX) - 1, height - mark_px, 2, mark_px);
    }
  }
}
