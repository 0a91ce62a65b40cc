/* The modules that the desk's components share. They import it by the name "kiks-desk", so that a page has one feed.
   The 3-D view is not here: it needs three.js, and is loaded when it is first shown ("kiks-desk/solid_view.js"). */

export { pageFeed } from "./feed.js";
export { clockText } from "./clock.js";
export { Stage } from "./stage.js";
export { Monitor } from "./monitor.js";
