/* The report of grades (see kiks/trials/report.py): a click on a name opens what belongs to it. Its player is a page in a
   frame, put together of the player's code, which the report has once, and the data of the run. */

const at = (id) => document.getElementById(id);
const player = JSON.parse(at("player").textContent);
const rows = [...document.querySelectorAll("#grades tr[data-id]")];

function show(open) {
  for (const row of rows) {
    const isOpen = row === open, details = at(`of-${row.dataset.id}`);
    row.classList.toggle("open", isOpen);
    row.querySelector("button").setAttribute("aria-expanded", String(isOpen));
    details.hidden = !isOpen;
    const place = details.querySelector(".run-player");
    if (place === null) continue;
    // Only one player works at a time.
    place.replaceChildren(...(isOpen ? [frameOf(place.dataset.run)] : []));
  }
  if (open) at(`of-${open.dataset.id}`).scrollIntoView({ block: "start" });
}

function frameOf(id) {
  const { section, frames } = JSON.parse(at(id).textContent), frame = document.createElement("iframe");
  frame.title = "The run";
  // Functions: in a text, $ would have a meaning.
  frame.srcdoc = player.replace("SECTION", () => section).replace("FRAMES", () => frames);
  frame.addEventListener("load", () => {
    const page = frame.contentDocument.documentElement;
    new ResizeObserver(() => (frame.style.height = `${page.offsetHeight + 2}px`)).observe(page);
  });
  return frame;
}

for (const row of rows)
  row.querySelector("button").addEventListener("click", () => show(row.classList.contains("open") ? null : row));

// The page for one student has no names to click.
for (const place of document.querySelectorAll(".details:not([hidden]) .run-player")) place.replaceChildren(frameOf(place.dataset.run));
