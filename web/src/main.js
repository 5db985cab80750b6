// Starts the viewer; where that fails, the page says so and keeps its picture and tables.

import { Comparison } from "./compare.js";
import { readPage } from "./data.js";
import { Viewer } from "./viewer.js";

async function start() {
  const note = document.getElementById("viewer-note");
  try {
    const { contents, open } = await readPage();
    if (contents.models) new Comparison(contents, open);
    else new Viewer(open(contents));
    note.hidden = true;
  } catch (error) {
    document.getElementById("viewer").classList.remove("live");
    note.textContent = `The turning model cannot be shown here (${error.message}). Everything else on this page is complete.`;
  }
}

start();
