"""The simulated clock: time on the serial line, thinking time and pace. The only place that may see the wall clock."""
