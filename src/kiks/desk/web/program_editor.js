/* The editor of programs: its accessible name, the page's theme, and the keys of the debugger. */

const editor = "[data-testid=editor]";

const tell = () => emitEvent("desk-dark", document.body.classList.contains("body--dark"));
new MutationObserver(tell).observe(document.body, { attributeFilter: ["class"] });
tell();

const name = () => {
  const text = document.querySelector(`${editor} .cm-content`);
  if (!text) return requestAnimationFrame(name);
  text.setAttribute("aria-label", "Program. Escape, then Tab leaves it. F9 sets a breakpoint.");
  text.tabIndex = 0;
};
name();

/** Set a breakpoint at a line, or remove it, by the element that has its number. */
const toggle = (at) => at && emitEvent("desk-breakpoint", Number(at.textContent));

addEventListener("click", ({ target }) => toggle(target.closest(`${editor} .cm-lineNumbers .cm-gutterElement`)));

addEventListener("keydown", (event) => {
  const { key, target, shiftKey } = event;
  if (event.ctrlKey || event.altKey || event.metaKey || !/^F\d+$/.test(key)) return;
  const button = document.querySelector(`[data-key="${shiftKey ? "Shift-" : ""}${key}"]`);
  const isForLine = key === "F9" && target.closest(editor);
  if (!isForLine && !button?.checkVisibility()) return;
  event.preventDefault();
  event.stopPropagation();
  if (isForLine) toggle(document.querySelector(`${editor} .cm-lineNumbers .cm-activeLineGutter`));
  else button.click();
}, true);
