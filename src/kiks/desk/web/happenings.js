/* What feeds have in common: the newest scene and frame, and the functions that are called when something happens. */

export class Happenings {
  /** `names` lists what can happen. */
  constructor(names) {
    this.scene = null;
    this.frame = null;
    this._listeners = Object.fromEntries(names.map((what) => [what, new Set()]));
  }

  on(what, callback) {
    this._listeners[what].add(callback);
    return () => this._listeners[what].delete(callback);
  }

  _tell(what, news) {
    for (const callback of [...this._listeners[what]]) callback(news);
  }

  /** Take the present shapes of turrets. */
  _takeShapes(message) {
    this.scene.robots.forEach((robot, index) => (robot.shapes = message.robots[index] ?? robot.shapes));
    this._tell("shapes", this.scene);
  }
}
