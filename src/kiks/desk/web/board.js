/* The board above the arena: the score of the run. In the hall view, for a projector, the page shows the board large,
   with the clock, and the arena; all controls are hidden.

   The messages "board" of the server carry the score, and frames carry the time. */

import { clockText, pageFeed } from "kiks-desk";

const HALL = "desk-hall";

export default {
  template: `
    <div class="kiks-board" v-show="isHall || hall || goal || entries.length" data-testid="board" role="region" aria-label="Score">
      <div v-if="hall" class="kiks-board-hall" data-testid="board-hall" role="status">
        <strong>{{ hall.title }}</strong>
        <span v-if="hall.last">{{ hall.last }}</span>
        <span v-if="hall.next">Next: <b>{{ hall.next }}</b></span>
      </div>
      <div v-if="isHall && !hall?.table.length" class="kiks-board-clock" data-testid="board-clock" role="timer">{{ clock }}<small
        v-if="end_s"> of {{ clockText(end_s).slice(0, -3) }}</small></div>
      <div v-if="goal" class="kiks-board-goal" data-testid="board-goal">
        <span class="kiks-board-text">{{ goal.text }}</span>
        <span v-if="!isHall" class="kiks-board-time" role="timer">{{ clock
          }}<template v-if="end_s"> of {{ clockText(end_s).slice(0, -3) }}</template></span>
        <span v-if="goal.points !== null" data-testid="board-points"><b>{{ goal.points }}</b> {{
          goal.points === 1 ? "point" : "points" }}</span>
        <strong v-if="goal.result" :class="['kiks-board-result', outcome]" role="status" data-testid="board-result">{{
          goal.result }}</strong>
      </div>
      <table v-if="hall?.table.length" class="kiks-board-table" data-testid="board-table">
        <thead><tr><th></th><th>Player</th><th>Games</th><th>Points</th></tr></thead>
        <tbody><tr v-for="(row, place) in hall.table" :key="row[0]">
          <td>{{ place + 1 }}.</td><th>{{ row[0] }}</th><td>{{ row[1] }}</td><td>{{ row[2] }}</td></tr></tbody>
      </table>
      <div v-else-if="isMatch" class="kiks-board-match">
        <span class="kiks-board-side"><i :style="ink(entries[0])"></i><b>{{ entries[0].name }}</b></span>
        <span class="kiks-board-value" data-testid="board-match">{{ entries[0].value }} : {{ entries[1].value }}</span>
        <span class="kiks-board-side"><b>{{ entries[1].name }}</b><i :style="ink(entries[1])"></i></span>
      </div>
      <dl v-else class="kiks-board-list">
        <div v-for="(entry, index) in entries" :key="index">
          <dt><i v-if="entry.colours !== null" :style="ink(entry)"></i>{{ entry.name }}</dt><dd>{{ entry.value }}</dd>
        </div>
      </dl>
      <button v-if="isHall" class="kiks-board-leave" data-testid="leave-hall" aria-label="Leave the hall view"
              title="Leave the hall view (Escape)" @click="leave">&#x2715;</button>
    </div>`,
  props: { feed: { type: String, default: "/desk/feed" } },
  data: () => ({ entries: [], goal: null, hall: null, end_s: null, isHall: false, clock: "" }),
  computed: {
    /** How the goal was decided; the judge begins its result so. */
    outcome() { return ["solved", "failed"].find((word) => this.goal.result.startsWith(word)) ?? "open"; },

    /** Two robots, and nothing else: a match. */
    isMatch() { return this.entries.length === 2 && this.entries.every(({ colours }) => colours !== null); },
  },
  mounted() {
    const feed = pageFeed(this.feed);
    this.stops = [
      feed.on("board", (board) => this.take(board)),
      feed.on("frame", ({ time_s }) => {
        if (this.isHall || this.goal) this.clock = clockText(time_s).slice(0, -1);
      }),
    ];
    if (feed.board) this.take(feed.board);
    this.press = (event) => event.key === "Escape" && this.isHall && this.leave();
    this.change = () => document.fullscreenElement || this.show(false);
    document.addEventListener("keydown", this.press);
    document.addEventListener("fullscreenchange", this.change);
  },
  unmounted() {
    for (const stop of this.stops) stop();
    document.removeEventListener("keydown", this.press);
    document.removeEventListener("fullscreenchange", this.change);
    this.show(false);
  },
  methods: {
    clockText,

    take({ score, goal, end_s, hall }) {
      this.entries = score;
      this.goal = goal;
      this.hall = hall;
      this.end_s = end_s;
    },

    ink({ colours }) { return { "--light": colours.light, "--dark": colours.dark }; },

    show(isHall) {
      this.isHall = isHall;
      document.body.classList.toggle(HALL, isHall);
    },

    /** Begin the hall view, on the whole screen where the browser allows it. */
    enter() {
      this.clock = clockText(pageFeed(this.feed).frame?.time_s ?? 0).slice(0, -1);
      this.show(true);
      document.documentElement.requestFullscreen?.().catch(() => {});
    },

    leave() {
      this.show(false);
      if (document.fullscreenElement) document.exitFullscreen();
    },
  },
};
