/** Format a simulated time: minutes, seconds and complete hundredths. */
export function clockText(time_s) {
  // Rounding errors may put a time just below a hundredth.
  const hundredths = Math.floor(time_s * 100 + 1e-6), two = (number) => String(number).padStart(2, "0");
  return `${Math.floor(hundredths / 6000)}:${two(Math.floor(hundredths / 100) % 60)}.${two(hundredths % 100)}`;
}
