/* The Vue component of the monitor (see monitor.js). A click on a number asks for its explanation. */

import { Monitor } from "kiks-desk";

const LOOKS = { purpose: "for an explanation", absent: "Waiting for the robot …" };

export default {
  template: `<div ref="root" class="kiks-monitor" data-testid="monitor"><div ref="answer"><slot></slot></div></div>`,
  props: {
    feed: { type: String, required: true },
    robot: { type: Number, default: 0 },
    chosen: { type: Object, default: null },
  },
  emits: ["explain", "seen"],
  watch: {
    robot(index) { this.monitor.setRobot(index); },
    chosen: { deep: true, handler(chosen) { this.monitor.choose(chosen); } },
  },
  mounted() {
    const { root, answer } = this.$refs;
    this.monitor = new Monitor(root, this.feed, (event, detail) => this.$emit(event, detail), { ...LOOKS, answer });
    this.monitor.setRobot(this.robot);
    this.monitor.choose(this.chosen);
    window.kiksMonitor = { drawn: () => this.monitor.frames_drawn };
  },
  beforeUnmount() {
    this.$emit("seen", false);
    this.monitor.dispose();
    delete window.kiksMonitor;
  },
};
