/* The Vue component of the monitor (see monitor.js). A click on a number asks for its explanation. */

import { CURVES, isDashed, lineColour, Monitor, placeOfNumber } from "kiks-desk";

export default {
  template: `
    <div ref="root" class="kiks-monitor" data-testid="monitor">
      <div v-if="!known" class="kiks-monitor-empty" role="status">Waiting for the robot …</div>
      <div v-show="known">
        <div class="kiks-monitor-robot" role="group" aria-label="Sensors around the robot: click one for an explanation">
          <canvas ref="robot" aria-hidden="true"></canvas>
          <div v-for="(name, k) in names" :key="k" class="kiks-chip" :style="chipStyle(k)">
            <span class="kiks-chip-name" aria-hidden="true">{{ number(k) }}</span>
            <button ref="near" type="button" :class="{chosen: isChosen(k, 'proximity')}" :data-testid="'proximity-' + k"
              :title="'Sensor ' + number(k) + ', ' + name + ': proximity. Click for an explanation'"
              :aria-pressed="isChosen(k, 'proximity')" @click="ask(k, 'proximity')">0</button>
            <button ref="light" type="button" class="kiks-chip-light" :class="{chosen: isChosen(k, 'ambient')}"
              :data-testid="'ambient-' + k" :title="'Sensor ' + number(k) + ', ' + name + ': light, less is brighter. Click for an explanation'"
              :aria-pressed="isChosen(k, 'ambient')" @click="ask(k, 'ambient')">0</button>
          </div>
        </div>
        <p class="kiks-monitor-hint">Upper number: proximity, 0 to 1023. Lower one: light, less is brighter. Click one for an explanation.</p>
        <slot></slot>

        <div class="kiks-wheels" role="group" aria-label="Wheels: measured and commanded speed">
          <template v-for="side in ['left', 'right']" :key="side">
            <span>{{ side }}</span>
            <span class="kiks-wheel-bar" :title="'Speed of the ' + side + ' wheel in pulses per 10 ms: the bar shows the measured speed, the line the commanded one'">
              <i ref="fills" class="kiks-wheel-fill"></i><i class="kiks-wheel-middle"></i><i ref="marks" class="kiks-wheel-mark"></i>
            </span>
            <span ref="speeds" class="kiks-wheel-text" :data-testid="'speed-' + side"></span>
          </template>
        </div>

        <div class="kiks-curve-choice" role="radiogroup" aria-label="Curves to show">
          <button v-for="(curve, name) in curves" :key="name" type="button" role="radio" :aria-checked="kind === name"
            :class="{chosen: kind === name}" :data-testid="'curves-' + name" :title="'Curves of ' + curve.label.toLowerCase()"
            @click="showKind(name)">{{ curve.label }}</button>
          <span class="kiks-curve-note">{{ curves[kind].note }}</span>
        </div>
        <canvas ref="curves" class="kiks-curves" role="img" :aria-label="curves[kind].label + ' over the last seconds'"></canvas>
        <div class="kiks-legend" role="group" aria-label="Lines to show">
          <button v-for="(name, k) in lines" :key="kind + name" type="button" :aria-pressed="!hidden.includes(k)"
            :class="{off: hidden.includes(k)}" :title="legendHint(k)" @click="toggle(k)">
            <i :style="{borderTopColor: colour(k), borderTopStyle: dashed(k) ? 'dashed' : 'solid'}"></i>{{ name }}
          </button>
        </div>

        <div v-show="hasCamera">
          <div class="kiks-monitor-title">Camera: 64 pixels from the left</div>
          <canvas ref="camera" class="kiks-camera" data-testid="camera-strip" role="img" aria-label="Picture of the camera"></canvas>
        </div>

        <dl class="kiks-facts" data-testid="facts">
          <div v-for="row in facts" :key="row[0]"><dt>{{ row[0] }}</dt><dd>{{ row[1] }}</dd></div>
        </dl>
      </div>
    </div>`,
  props: {
    feed: { type: String, default: "/desk/feed" },
    robot: { type: Number, default: 0 },
    chosen: { type: Object, default: null },
  },
  emits: ["explain", "seen"],
  data: () => ({ known: null, facts: [], hasCamera: false, firstSensor: 0, kind: "proximity", hidden: [], isDark: false }),
  computed: {
    names() { return CURVES.proximity.names.map((_, k) => this.known?.sensors[k].name ?? ""); },
    curves: () => CURVES,
    lines() { return CURVES[this.kind].names.map((name, line) => (this.kind === "speeds" ? name : `${this.number(line)}`)); },
  },
  watch: {
    robot(index) { this.monitor.setRobot(index); },
    chosen: { deep: true, handler(chosen) { this.monitor.choose(chosen); } },
  },
  mounted() {
    const { root, robot, curves, near, light, fills, marks, speeds } = this.$refs;
    const wheels = fills.map((fill, k) => ({ fill, mark: marks[k], text: speeds[k] }));
    const parts = {
      root, robot, curves, camera: () => this.$refs.camera, wheels: () => wheels,
      numbers: () => ({ proximity: near, ambient: light }),
    };
    this.monitor = new Monitor(parts, this.feed, (event, detail) => this.hear(event, detail));
    this.monitor.setRobot(this.robot);
    this.monitor.choose(this.chosen);
    window.kiksMonitor = { drawn: () => this.monitor.frames_drawn };
  },
  beforeUnmount() {
    this.$emit("seen", false);
    this.monitor.dispose();
    delete window.kiksMonitor;
  },
  methods: {
    hear(event, detail) {
      if (event === "known") this.known = detail;
      else if (event === "firstSensor") this.firstSensor = detail;
      else if (event === "seen") this.$emit("seen", detail);
      else {
        this.facts = detail.rows;
        this.hasCamera = detail.hasCamera;
        this.isDark = this.monitor.isDark;
      }
    },
    ask(sensor, which) { this.$emit("explain", { sensor, which }); },
    number(sensor) { return sensor + this.firstSensor; },
    isChosen(sensor, which) { return this.chosen?.sensor === sensor && this.chosen?.which === which; },
    chipStyle(sensor) {
      const [across, down] = placeOfNumber(sensor);
      return { left: `${100 * across}%`, top: `${100 * down}%`, borderColor: lineColour("proximity", sensor, this.isDark) };
    },
    showKind(kind) {
      this.kind = kind;
      this.hidden = [];
      this.monitor.show(kind, []);
    },
    toggle(line) {
      this.hidden = this.hidden.includes(line) ? this.hidden.filter((each) => each !== line) : [...this.hidden, line];
      this.monitor.show(this.kind, this.hidden);
    },
    colour(line) { return lineColour(this.kind, line, this.isDark); },
    dashed(line) { return isDashed(this.kind, line); },
    legendHint(line) {
      const what = this.kind === "speeds" ? ["Left wheel, measured", "Right wheel, measured", "Left wheel, commanded", "Right wheel, commanded"][line]
        : `Sensor ${this.number(line)}, ${this.names[line]}`;
      return `${what}: show or hide its line`;
    },
  },
};
