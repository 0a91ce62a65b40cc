/* The Vue component of the monitor (see monitor.js). A click on a number asks for its explanation. */

import { Monitor } from "kiks-desk";

const LOOKS = { purpose: "for an explanation", absent: "Waiting for the robot …", asksToKeep: true };

export default {
  template: `<div ref="root" class="kiks-monitor" data-testid="monitor"></div>`,
  props: {
    feed: { type: String, required: true },
    robot: { type: Number, default: 0 },
    chosen: { type: Object, default: null },
    why: { type: Object, default: null },
  },
  emits: ["explain", "keep", "seen"],
  watch: {
    robot(index) { this.monitor.setRobot(index); },
    chosen: { deep: true, handler(chosen) { this.monitor.choose(chosen); } },
    why(why) { this.monitor.explain(why); },
  },
  mounted() {
    this.monitor = new Monitor(this.$refs.root, this.feed, (event, detail) => this.$emit(event, detail), LOOKS);
    this.monitor.setRobot(this.robot);
    this.monitor.choose(this.chosen);
    this.monitor.explain(this.why);
    window.kiksMonitor = { drawn: () => this.monitor.frames_drawn };
  },
  beforeUnmount() {
    this.$emit("seen", false);
    this.monitor.dispose();
    delete window.kiksMonitor;
  },
};
