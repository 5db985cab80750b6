// The list of all parts, made when it is opened: find a part, show it, hide it.

const MOST_ROWS = 400;

function cell(row, text) {
  const td = document.createElement("td");
  td.textContent = text;
  row.append(td);
  return td;
}

export class PartList {
  constructor(viewer) {
    this.viewer = viewer;
    this.details = document.getElementById("part-list");
    this.body = this.details.querySelector("tbody");
    this.search = document.getElementById("part-search");
    this.note = document.getElementById("part-note");
    this.details.hidden = false;
    this.details.addEventListener("toggle", () => this.fill());
    this.search.addEventListener("input", () => this.fill());
  }

  fill() {
    this.body.replaceChildren();
    if (!this.details.open) return;
    const wanted = this.search.value.trim().toLowerCase();
    const found = this.viewer.model.parts
      .filter((part) =>
        `${part.number} ${part.name} ${part.color} ${part.submodel}`.toLowerCase().includes(wanted),
      )
      .sort((a, b) => b.energy - a.energy || a.index - b.index);
    for (const part of found.slice(0, MOST_ROWS)) this.body.append(this.row(part));
    this.note.textContent =
      found.length > MOST_ROWS
        ? `The first ${MOST_ROWS} of ${found.length} parts; search to see others.`
        : `${found.length} parts.`;
  }

  row(part) {
    const row = document.createElement("tr");
    const shown = document.createElement("input");
    shown.type = "checkbox";
    shown.checked = this.viewer.stage.visible(part.index);
    shown.setAttribute("aria-label", `Show ${part.name}`);
    shown.addEventListener("change", () => this.viewer.setShown([part.index], shown.checked));
    cell(row, "").append(shown);
    const fly = document.createElement("button");
    fly.type = "button";
    fly.className = "link";
    fly.textContent = part.name;
    fly.addEventListener("click", () => this.viewer.flyTo(part.index));
    cell(row, "").append(fly);
    cell(row, part.number);
    cell(row, part.color);
    cell(row, part.step ? `${part.submodel}, step ${part.step}, line ${part.line}` : part.submodel);
    cell(row, `${(100 * part.energy).toFixed(1)} %`).className = "number";
    return row;
  }

  refresh() {
    if (this.details.open) this.fill();
  }
}
