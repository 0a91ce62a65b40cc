/* The geometry of a gripper's arm and jaws, from frames. Lengths in mm in the robot's own frame, x ahead, y left;
   the constants are those of kiks/firmware/gripper.py and kiks/engine/physics/gripper.py. */

export const PIVOT_MM = -15;
const START_RAD = (-10 * Math.PI) / 180;
const SWING_RAD = (200 * Math.PI) / 180;
const JAW_LENGTH_MM = 37;
const JAW_WIDTH_MM = 4;
const GAP_MM = 0.5;
const GAP_PER_STEP_MM = 27 / 200;

/** Half the distance between the jaws, and where along the arm they begin and end. */
export function jawsOf(robot, radius_mm) {
  return {
    gap_mm: GAP_MM + GAP_PER_STEP_MM * robot.jaws,
    width_mm: JAW_WIDTH_MM,
    from_mm: radius_mm - PIVOT_MM,
    to_mm: radius_mm + JAW_LENGTH_MM - PIVOT_MM,
  };
}

/** Elevation of the arm: 0 down in front, pi down behind [rad]. */
export function armAngle(robot) {
  return Math.PI - (START_RAD + (SWING_RAD * robot.arm) / 255);
}

/** Distance of a point of the arm ahead of the robot's middle, seen from above [mm]. */
export function aheadOf(along_mm, robot) {
  return PIVOT_MM + along_mm * Math.cos(armAngle(robot));
}
