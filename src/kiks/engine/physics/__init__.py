"""How things move: motors, motion, contact with walls, collisions, the gripper."""
