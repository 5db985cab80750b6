// Starts the viewer; where that fails, the page says so and keeps its picture and tables.

import { readModel } from "./data.js";
import { Viewer } from "./viewer.js";

async function start() {
  const note = document.getElementById("viewer-note");
  try {
    new Viewer(await readModel());
    note.hidden = true;
  } catch (error) {
    document.getElementById("viewer").classList.remove("live");
    note.textContent = `The turning model cannot be shown here (${error.message}). Everything else on this page is complete.`;
  }
}

start();
