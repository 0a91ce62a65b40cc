/** Return a simulated time for a person: minutes, seconds, hundredths that are over. */
export function clockText(time_s) {
  // Whole hundredths come as numbers just below them.
  const hundredths = Math.floor(time_s * 100 + 1e-6), two = (number) => String(number).padStart(2, "0");
  return `${Math.floor(hundredths / 6000)}:${two(Math.floor(hundredths / 100) % 60)}.${two(hundredths % 100)}`;
}
