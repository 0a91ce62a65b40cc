/* Numbers as Python writes them: what is half way between two goes to the even one, in the page's texts as in all others. */

/** Return a number with some digits after the point, as `f"{number:.2f}"` is. */
export function fixed(number, digits) {
  if (!Number.isFinite(number)) return withoutDigits(number);
  const size = Math.abs(number);
  return signOf(number) + toEven(size.toFixed(digits), size.toFixed(100).replace(".", ""));
}

/** Return a number with its six leading digits, as `f"{number:g}"` is. */
export function general(number) {
  if (!Number.isFinite(number)) return withoutDigits(number);
  const size = Math.abs(number), [digits, power] = size.toExponential(5).split("e");
  const even = toEven(digits, size.toExponential(100).split("e")[0].replace(".", ""));
  if (power >= -4 && power < 6) return signOf(number) + Number(`${even}e${power}`);
  return `${signOf(number)}${Number(even)}e${power[0]}${power.slice(1).padStart(2, "0")}`;
}

/** A text of digits as JavaScript rounds it, half a digit upwards; `exact` has all digits, and no point. */
function toEven(text, exact) {
  const count = text.replace(".", "").length, last = exact[count - 1];
  return last % 2 === 0 && /^50*$/.test(exact.slice(count)) ? text.slice(0, -1) + last : text;
}

function signOf(number) { return number < 0 || Object.is(number, -0) ? "-" : ""; }

function withoutDigits(number) { return Number.isNaN(number) ? "nan" : number < 0 ? "-inf" : "inf"; }
