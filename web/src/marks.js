// Numbered discs over the model: the worst weak spots. They follow it and can be pressed.

import { Vector3 } from "three";

const SHOWN = 5;

export class Marks {
  constructor(holder, spots, choose) {
    this.holder = holder;
    this.marks = spots.slice(0, SHOWN).map((spot) => {
      const mark = document.createElement("button");
      mark.type = "button";
      mark.className = "mark";
      mark.textContent = String(spot.rank);
      mark.setAttribute("aria-label", `Weak spot ${spot.rank}`);
      // The table below has the same buttons for the keyboard.
      mark.tabIndex = -1;
      mark.addEventListener("click", () => choose(spot));
      holder.append(mark);
      return { mark, spot };
    });
  }

  show(shown) {
    this.holder.hidden = !shown;
  }

  place(stage, camera, width, height) {
    if (this.holder.hidden) return;
    const taken = [];
    for (const { mark, spot } of this.marks) {
      const point = spot.point ? new Vector3(...spot.point) : stage.centroid(spot.part);
      const seen = stage.moving(spot.part, point).project(camera);
      let x = ((seen.x + 1) / 2) * width;
      const y = ((1 - seen.y) / 2) * height;
      // Discs side by side rather than over each other.
      while (taken.some(([a, b]) => Math.hypot(a - x, b - y) < 21)) x += 21;
      taken.push([x, y]);
      const inside = Math.abs(seen.z) <= 1 && x > 0 && x < width && y > 0 && y < height;
      mark.hidden = !inside || !stage.visible(spot.part);
      mark.style.transform = `translate(${Math.round(x)}px, ${Math.round(y)}px) translate(-50%, -50%)`;
    }
  }
}
