/* The clock above the arena: simulated time and its speed, taken from frames at the browser's own rate. */

import { clockText, pageFeed } from "kiks-desk";

export default {
  template: `
    <div class="kiks-clock">
      <div class="text-subtitle1 text-weight-medium" data-testid="clock" title="Simulated time">{{ clock }}</div>
      <div class="text-caption desk-from-1200" data-testid="rate">{{ rate }}</div>
    </div>`,
  props: { feed: { type: String, default: "/desk/feed" } },
  data: () => ({ clock: clockText(0), rate: "" }),
  mounted() {
    this.stop = pageFeed(this.feed).on("frame", ({ time_s, speed_now, speed_average }) => {
      this.clock = clockText(time_s);
      this.rate = `${speed_average.toFixed(1)} x on average, ${speed_now.toFixed(1)} x now`;
    });
  },
  unmounted() { this.stop(); },
};
