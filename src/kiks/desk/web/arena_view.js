/* The Vue component of the arena: the view from above, the 3-D view, or both (see stage.js).
   It is served from another address than the modules beside it, so it imports them by the name "kiks-desk" only. */

import { Stage } from "kiks-desk";

export default {
  template: `<div ref="root" class="kiks-arena" data-testid="arena"></div>`,
  props: {
    feed: { type: String, required: true },
    keys: { type: String, required: true },
    tool: { type: Object, default: () => ({ kind: "hand" }) },
    show: { type: Object, default: () => ({}) },
    wall: { type: Object, default: null },
    view: { type: String, default: "top" },
    follow: { type: Number, default: -1 },
  },
  emits: ["pick", "edit", "draw", "remove"],
  watch: {
    tool: { deep: true, handler(tool) { this.stage.setTool(tool); } },
    show: { deep: true, handler(show) { this.stage.setShow({ ...show }); } },
    wall(wall) { this.stage.setWall(wall); },
    view(view) { this.stage.setView(view); },
    follow(follow) { this.stage.setFollow(follow); },
  },
  mounted() {
    const stage = new Stage(this.$refs.root, this.feed, this.keys, (event, detail) => this.$emit(event, detail));
    this.stage = stage;
    stage.setTool(this.tool);
    stage.setShow({ ...this.show });
    stage.setFollow(this.follow);
    stage.setDark(null); // as the page
    stage.setView(this.view);
    window.kiksDesk = {
      pose: (index) => stage.feed.frame?.pose(index),
      stats: () => stage.stats(),
      toClient: (x_mm, y_mm) => stage.toClient(x_mm, y_mm),
      scene: () => stage.feed.scene,
      shown: () => ({ ...stage.show }),
      isSolid: () => stage.solidView !== null && stage.solid_frames > 0,
    };
  },
  unmounted() {
    this.stage.dispose();
    delete window.kiksDesk;
  },
  methods: {
    fit() { this.stage.fit(); },
    snapshot() { this.stage.snapshot(); },
    clear_trails() { this.stage.clearTrails(); },
  },
};
